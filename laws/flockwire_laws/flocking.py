"""Flocking, algorithm 2: `law = "flocking"`.

R. Olfati-Saber, "Flocking for multi-agent dynamic systems: algorithms and theory", IEEE Trans. Automatic Control 51(3),
2006, (24):

    u_i = sum phi_a(|q_j − q_i|_s) n_ij + sum a_ij (p_j − p_i) − c1 (q_i − q_r) − c2 (p_i − p_r),   |q_j − q_i| < r
    |z|_s = (sqrt(1 + eps |z|^2) − 1)/eps,   n_ij = (q_j − q_i)/sqrt(1 + eps |q_j − q_i|^2),   a_ij = rho_h(|.|_s/r_s)
    phi_a(z) = rho_h(z/r_s) phi(z − d_s),   phi(z) = ((a + b) s1(z + c) + a − b)/2,   s1(z) = z/sqrt(1 + z^2)
    c = |a − b|/sqrt(4 a b),   rho_h(z) = 1 (z < h), (1 + cos(pi (z − h)/(1 − h)))/2 (z < 1), 0

q position (m), p velocity (m/s), u acceleration (m/s^2), d distance (m), r = 1.2 d, d_s = |d|_s, r_s = |r|_s. The gamma
agent, which every drone knows, flies q_r = target + t drift. The constants are the source's, c1 and c2 ours; phi is not
scale-free: `scale` makes all lengths in the sums that much smaller, with the same times. `radius` is r at scale 1: the
gateway shows what is nearer, the law uses what is nearer than r. The centre obeys c'' = −c1 (c − q_r) − c2 (c' − p_r),
exactly.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import size


class Gains(fw.Parameters):
    """As in the equation."""

    scale: fw.Positive = 1.0 / 7.0
    distance: fw.Positive = 7.0  # m at scale 1, d
    eps: fw.Positive = 0.1  # 1/m^2
    a: fw.Positive = 5.0  # m/s^2
    b: fw.Positive = 5.0  # m/s^2
    h: fw.Share = 0.2
    c1: fw.NotNegative = 0.2  # 1/s^2
    c2: fw.NotNegative = 0.9  # 1/s
    target: tuple[float, float, float] = (0.0, 0.0, 1.0)  # m
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s


class Flocking:
    """The law for one drone."""

    information = fw.Information(around=fw.STATE, radius=8.4, own=fw.STATE, output=fw.Output.ACCELERATION, planar=True)
    Parameters = Gains
    check = classmethod(checks.flocking)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gains = Gains.of(settings.parameters)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; the error is the distance from the gamma agent."""
        g = self._gains
        if observation.place is None or observation.position is None or observation.velocity is None:
            return fw.Decision()
        away = np.array(observation.position) - g.target - observation.t * np.array(g.drift)
        command = -g.c1 * away - g.c2 * (np.array(observation.velocity) - g.drift)
        reach, rest, c = self._norm(1.2 * g.distance), self._norm(g.distance), abs(g.a - g.b) / np.sqrt(4 * g.a * g.b)
        for one in observation.around:
            line = np.array(one.position) / g.scale
            s = self._norm(size(line))
            z, x = s / reach, s - rest + c
            rho = 1.0 if z < g.h else 0.5 * (1.0 + np.cos(np.pi * (z - g.h) / (1.0 - g.h))) if z < 1.0 else 0.0
            phi = 0.5 * ((g.a + g.b) * x / np.sqrt(1.0 + x * x) + g.a - g.b)
            command += rho * (g.scale * phi * line / (1.0 + g.eps * s) + np.array(one.velocity))
        return fw.Decision(command, error=size(away))

    def _norm(self, length: float) -> float:
        """Return the sigma-norm of a vector of `length`."""
        return float((np.sqrt(1.0 + self._gains.eps * length**2) - 1.0) / self._gains.eps)
