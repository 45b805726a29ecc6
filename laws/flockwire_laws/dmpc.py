"""Distributed model predictive control with shared predictions: `law = "dmpc"`.

C. E. Luis, A. P. Schoellig, "Trajectory generation for multiagent point-to-point transitions via distributed model
predictive control", IEEE Robotics and Automation Letters 4(2), 2019. Every plan minimises over a[0..K−1]

    Q |p[K] − goal|^2 + R sum |a[k]|^2 + S sum |a[k] − a[k−1]|^2 + sum (e_j^2 − 5e4 e_j),   |a| <= a_max per axis
    n'(p[k_c] − p_j[k_c]) >= r_min + e_j,   e_j <= 0,   n = (p[k_c] − p_j[k_c])/|.|   for all j within 3 r_min there

with p[k+1] = p[k] + h v[k] + h^2/2 a[k], K = 15, h = 0.2 s; k_c is the first k at which the last predictions come
nearer than r_min. Position p, r_min (m), v (m/s), a (m/s^2); the goal is the place. Q is 1e4 within 1 m of the goal,
else 1e3, S = 10, R = 1; with a collision Q = 1000, S = 100. A plan is of the state predicted for its deadline, 0.1 s on
(it counts then); each sends its K positions. No theorem: least distances 0.95 to 1.06 r_min. In the plane.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.dmpc_program import REACH, TIMES, Plan, sample, shifted, solve
from flockwire_laws.relative import size

DEADLINE = 0.1  # s
P = tuple[float, float]


class Predicted(NamedTuple):
    """p[1..K], m, from the stamp on."""

    points: tuple[P, P, P, P, P, P, P, P, P, P, P, P, P, P, P]


class Constants(fw.Parameters):
    """As in the equations."""

    a_max: fw.Positive = 1.0
    r_min: fw.Positive = 0.5


class Dmpc:
    """The law for one drone."""

    information = fw.Information(
        own=fw.STATE, output=fw.Output.ACCELERATION, message=Predicted, planar=True, deadline=DEADLINE
    )
    Parameters = Constants
    check = classmethod(checks.dmpc)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._constants, self._sent = Constants.of(settings.parameters), 0

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return the newest plan's acceleration, and its positions once; the error is the distance from the place."""
        place, plan = observation.place, observation.plan
        if place is None or observation.position is None:
            return fw.Decision()
        error = size(np.subtract(place.offset(observation.t), observation.position)[:2])
        if plan is None:
            return fw.Decision(error=error)
        rows: Any = tuple(map(tuple, plan.positions.tolist()))
        points = Predicted(rows) if plan.start != self._sent else None
        self._sent = plan.start
        return fw.Decision((*sample(plan, observation.now), 0.0), points, error, stamp=plan.start if points else 0)

    def plan(self, observation: fw.Observation) -> Plan | None:
        """Return the plan that counts from the deadline on; None without a place or a pose."""
        place, last = observation.place, observation.plan
        if place is None or observation.position is None or observation.velocity is None:
            return None
        a, v = sample(last, observation.now) if last else np.zeros(2), np.array(observation.velocity)[:2]
        p, v = np.array(observation.position)[:2] + DEADLINE * v + DEADLINE**2 / 2 * a, v + DEADLINE * a
        start, free = observation.now + round(DEADLINE * fw.SECOND), p + np.outer(TIMES, v)
        own = shifted(last.positions, last.start, start) if last else free
        others = [shifted(np.array(one.content.points), one.stamp, start) for one in observation.heard]
        goal, c = np.array(place.offset(observation.t))[:2], self._constants
        accelerations = solve(c.a_max, c.r_min, free, goal, a, own, others)
        return Plan(start, accelerations, free + REACH @ accelerations)
