"""Manoeuvres of a formation by bearings, 5c: `law = "flockwire_laws.manoeuvre:Manoeuvre"`.

S. Zhao, D. Zelazo, "Translational and scaling formation maneuver control via a bearing-based approach", TCNS 4(3),
2017:

    u_i = K_i^-1 sum P(g*_ij) [a_j − kp (p_i − p_j) − kv (v_i − v_j)],   K_i = sum P(g*_ij),   P(x) = I − x x'

u m/s^2, kp 1/s^2, kv 1/s, a_j what j commands; all else as in bearing.py. Leaders move, at least two: translations and
the scale are theirs. e'' + kv e' + kp e = 0.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws.bearing import Bearing
from flockwire_laws.relative import Acceleration, flown_acceleration, size, vector


class Manoeuvre(Bearing):
    """The law 5c for one follower."""

    information = fw.Information(
        fw.STATE, output=fw.Output.ACCELERATION, message=Acceleration, leaders=(2, 9), directed=False
    )
    lead = staticmethod(flown_acceleration)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; the error is |K_i^-1 sum P(g*_ij) (p_i − p_j)|."""
        if observation.place is None:
            return fw.Decision()
        sent = {one.number: one.content.acceleration for one in observation.heard}
        command, apart, total = np.zeros(3), np.zeros(3), np.zeros((3, 3))
        for one in observation.neighbours:
            g, line = self.wanted(observation.place, one.number, observation.t), np.array(one.position)
            across, ahead = g.any() * np.eye(3) - np.outer(g, g), np.array(sent.get(one.number, (0.0, 0.0, 0.0)))
            command += across @ (ahead + self.gains.kp * line + self.gains.kv * np.array(one.velocity))
            apart, total = apart + across @ line, total + across
        command, apart = np.linalg.pinv(total) @ command, np.linalg.pinv(total) @ apart
        return fw.Decision(command, Acceleration(vector(command)), size(apart))
