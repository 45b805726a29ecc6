"""Control barrier functions of second order: `law = "barrier"`; barrier_first_order.py has them for velocities.

L. Wang, A. D. Ames, M. Egerstedt, "Safety barrier certificates for collisions-free multirobot systems", IEEE Trans.
Robotics 33(3), 2017. Each drone solves, with dp = p_i − p_j, dv = v_i − v_j for all j in range, all of the same alpha,

    min |u_i − û_i|^2   s.t.   −dp'u_i <= b_ij/2,   |u_i| <= alpha per axis;   A = 2 alpha
    h_ij = sqrt(2 A (|dp| − D)) + dp'dv/|dp|
    b_ij = gamma h^3 |dp| + |dv|^2 − (dp'dv)^2/|dp|^2 + A dp'dv/sqrt(2 A (|dp| − D))
    FirstOrder: h = |dp|^2 − D^2,   −2 dp'u_i <= gamma h^3/2,   |u_i| <= speed per axis

p, v, u position, velocity, acceleration (m, m/s, m/s^2; FirstOrder: u velocity), D distance to be kept (m). û leads to
the place: û = kv (v* − v), v* = k (h_i − p) of at most `speed`; FirstOrder û = v*. h >= 0 at the start keeps |dp| >= D
for ever. `radius` covers D + ((2A/gamma)^(1/3) + 2 speed)^2/(2A) of the defaults. Where no u is left it brakes.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.quadratic import minimise
from flockwire_laws.relative import Array, size

FLOOR = 1e-4  # m, least |dp| − D in the square root


class Gains(fw.Parameters):
    """As in the equations."""

    distance: fw.Positive = 0.5  # m, D
    alpha: fw.Positive = 1.0  # m/s^2
    gamma: fw.Positive = 0.5  # 1/(m s)^..: of h^3
    speed: fw.Positive = 1.0  # m/s
    gain: fw.Positive = 1.0  # 1/s, k
    kv: fw.Positive = 2.0  # 1/s


class Barrier:
    """The law of second order for one drone, in the plane."""

    information = fw.Information(around=fw.STATE, radius=4.5, own=fw.STATE, output=fw.Output.ACCELERATION, planar=True)
    Parameters = Gains
    check = classmethod(checks.barrier)

    def __init__(self, settings: fw.LawSettings) -> None:
        self.gains = Gains.of(settings.parameters)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; the error is the distance from the place."""
        g, place = self.gains, observation.place
        if place is None or observation.position is None or observation.velocity is None:
            return fw.Decision()
        away = np.subtract(place.offset(observation.t), observation.position)[:2]
        own = np.array(observation.velocity)[:2]
        towards = g.gain * away * min(1.0, g.speed / max(g.gain * size(away), 1e-9))
        wanted, most, braking = self.nominal(towards, own)
        rows, limits = [*np.eye(2), *-np.eye(2)], [-most] * 4
        for one in observation.around:
            dp, dv = -np.array(one.position)[:2], -np.array(one.velocity)[:2]
            rows.append(dp)
            limits.append(-self.bound(dp, dv))
        found = minimise(np.eye(2), -wanted, np.array(rows), np.array(limits))
        command = braking if found is None else found
        return fw.Decision((*command, 0.0), error=size(away))

    def nominal(self, towards: Array, own: Array) -> tuple[Array, float, Array]:
        """Return û, its largest size per axis, and the command that brakes."""
        g = self.gains
        return g.kv * (towards - own), g.alpha, np.clip(-g.kv * own, -g.alpha, g.alpha)

    def bound(self, dp: Array, dv: Array) -> float:
        """Return b_ij/2."""
        g, distance, closing = self.gains, max(size(dp), FLOOR), float(dp @ dv)
        root = np.sqrt(4.0 * g.alpha * max(distance - g.distance, FLOOR))
        h = root + closing / distance
        b = g.gamma * h**3 * distance + dv @ dv - closing**2 / distance**2 + 2.0 * g.alpha * closing / root
        return float(0.5 * b)
