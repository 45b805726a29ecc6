"""The formation error of a follower's last step, by its law's own measure or by its estimate of the leader."""

from __future__ import annotations

from math import dist, isfinite

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add
from flockwire_core.law import Decision, Observation

NONE = -1.0  # m: there is no error


def estimated_place(observation: Observation, decision: Decision) -> Vector | None:
    """Return the place h_i + eta_i, m; None without one."""
    place, leader = observation.place, decision.message
    if not isinstance(leader, LeaderMotion) or observation.motion is None or place is None:
        return None
    goal = add(place.offset((observation.stamp - place.start) / SECOND), leader.position)
    return goal if all(map(isfinite, goal)) else None


def formation_error(observation: Observation, decision: Decision, place: Vector | None) -> float:
    """Return the law's own error, else |x_i − h_i − eta_i|, m; NONE without one."""
    if decision.error is not None and observation.place is not None:
        return float(decision.error)
    motion = observation.motion
    return dist(motion.position, place) if motion is not None and place is not None else NONE
