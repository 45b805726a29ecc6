"""Affine formation manoeuvres by several leaders: `law = "affine"` is 7b.

S. Zhao, "Affine formation maneuver control of multiagent systems", IEEE Trans. Automatic Control 63(12), 2018:

    7a AtRest        u_i = −k sum omega_ij (p_i − p_j), leaders at rest                               velocity (m/s)
    7b Affine        u_i = 1/gamma_i sum omega_ij [v_j − k (p_i − p_j)]                               velocity (m/s)
    7c Accelerating  u_i = 1/gamma_i sum omega_ij [a_j − kp (p_i − p_j) − kv (v_i − v_j)]             m/s^2

p, v position, velocity (m, m/s), k and kv 1/s, kp 1/s^2, gamma_i = sum_j omega_ij; v_j or a_j is what j commands, or a
leader flies. The weights of the edges are stresses omega_ij = omega_ji of either sign, sum_j omega_ij (r_i − r_j) = 0
at the nominal r: the places; of leaders `leader_places` (m), their starts. d + 1 leaders span the shape. p_f
-> −Omega_ff^-1 Omega_fl p_l, whatever affine image the leaders show: 7a at the rate k lambda_min(Omega_ff), 7b
e' = −k e, 7c e'' + kv e' + kp e = 0. 7b and 7c need rho(M) < 1, m_ij = omega_ij / gamma_i among followers: what
is fed on is a sample old, and that error counts 1/(1 − rho) fold.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Acceleration, Velocity, flown_acceleration, flown_velocity, size, vector


class Gains(fw.Parameters):
    """The gains, and the leaders' nominal places by number."""

    gain: fw.Positive = 0.5  # 1/s
    kp: fw.Positive = 0.5  # 1/s^2
    kv: fw.Positive = 2.0  # 1/s
    leader_places: dict[int, tuple[fw.Finite, fw.Finite, fw.Finite]] = {}  # noqa: RUF012  (m; pydantic copies it)


class Affine:
    """The law 7b for one follower."""

    information = fw.Information(fw.Sense.POSITION, message=Velocity, leaders=(3, 64), directed=False, signed=True)
    Parameters = Gains
    check = classmethod(checks.affine)
    lead: ClassVar[Any] = staticmethod(flown_velocity)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gains = Gains.of(settings.parameters)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i, and sends it on; the error is |sum omega_ij (p_i − p_j) / gamma_i|."""
        if observation.place is None:
            return fw.Decision()
        g, output, kind = self._gains, self.information.output, self.information.message
        sent = {one.number: one.content[0] for one in observation.heard}
        pull, apart, total = np.zeros(3), np.zeros(3), 0.0
        for one in observation.neighbours:
            line = np.array(one.position)
            feedback = g.gain * line if output is fw.Output.VELOCITY else g.kp * line + g.kv * np.array(one.velocity)
            pull += one.weight * (np.array(sent.get(one.number, (0.0, 0.0, 0.0))) + feedback)
            apart, total = apart + one.weight * line, total + one.weight
        if not total and kind:
            return fw.Decision()
        command = pull / total if kind else pull
        return fw.Decision(command, kind and kind(vector(command)), abs(size(apart) / total) if total else None)


class AtRest(Affine):
    """The law 7a for one follower."""

    information = Affine.information._replace(message=None)


class Accelerating(Affine):
    """The law 7c for one follower."""

    information = Affine.information._replace(
        neighbours=fw.Sense.POSITION | fw.Sense.VELOCITY, message=Acceleration, output=fw.Output.ACCELERATION
    )
    lead = staticmethod(flown_acceleration)
