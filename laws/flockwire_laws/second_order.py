"""Second-order consensus and formation tracking: `law = "second_order"` is 2b, `SecondOrder`.

W. Ren, "Consensus strategies for cooperative control of vehicle formations", IET Control Theory and Applications 1(2),
2007; "Multi-vehicle consensus with a time-varying reference state", Systems & Control Letters 56, 2007; "On consensus
algorithms for double-integrator dynamics", IEEE Trans. Automatic Control 53(6), 2008.

    2a Relative     u_i = −sum_j w_ij [(z_i − z_j) + gamma (v_i − v_j)]
    2b SecondOrder  u_i = h_i'' + 1/kappa_i sum_j w_ij [a_j − h_j'' − kp (z_i − z_j) − kv (z_i' − z_j')]
    2c Relative     u_i = −sum_j w_ij [kp (z_i − z_j) + kv (v_i − v_j)]

p, v, u position, velocity, acceleration (m, m/s, m/s^2), z_i = p_i − h_i, kappa_i = sum_j w_ij, gamma s, kp 1/s^2,
kv 1/s (2a: kp = 1, kv = gamma). 2b: a_j is what j commands, or the leader flies, sent in each step; on every graph
e'' + kv e' + kp e = 0.
2a agrees at −max Re of the roots of s^2 + gamma lambda s + lambda; gamma^2 <= max b^2/(a |lambda|^2) over the
eigenvalues lambda = a + jb of L but 0 diverges. 2c trails a leader that accelerates by a_0: L_ff^-1 1 a_0 / kp.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Acceleration, derivatives, flown_acceleration, size, vector


class Gains(fw.Parameters):
    """The gains; 2a has kp = 1 and gamma = kv."""

    kp: fw.Positive = 1.0  # 1/s^2
    kv: fw.Positive = 2.5  # 1/s


class SecondOrder:
    """The law 2b for one follower."""

    fed: ClassVar[bool] = True
    information = fw.Information(
        neighbours=fw.STATE, output=fw.Output.ACCELERATION, message=Acceleration, leaders=(1, 1)
    )
    Parameters = Gains
    check = classmethod(checks.second_order)
    lead = staticmethod(flown_acceleration)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gains = Gains.of(settings.parameters)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i and sends it on if it is fed; the error is |sum_j w_ij (z_i − z_j)| / kappa_i."""
        place, gains, fed = observation.place, self._gains, self.fed
        if place is None:
            return fw.Decision()
        sent = {one.number: one.content.acceleration for one in observation.heard}
        apart, pull, total = np.zeros(3), np.zeros(3), 0.0
        for one in observation.neighbours:
            offset, rate, acceleration = derivatives(place, one.number, observation.t)
            z = np.array(one.position) + offset
            velocity = np.array(one.velocity) + (rate if fed else 0.0)
            ahead = sent.get(one.number, np.zeros(3)) + acceleration if fed else np.zeros(3)
            pull += one.weight * (ahead + gains.kp * z + gains.kv * velocity)
            apart, total = apart + one.weight * z, total + one.weight
        command = pull / total if fed and total else pull
        message = Acceleration(vector(command)) if fed else None
        return fw.Decision(command, message, size(apart) / total if total else None)


class Relative(SecondOrder):
    """The laws 2a, without a leader, and 2c, with one."""

    fed = False
    information = fw.Information(neighbours=fw.STATE, output=fw.Output.ACCELERATION, leaders=(0, 1))
