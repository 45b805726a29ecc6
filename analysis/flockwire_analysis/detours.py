"""Finds times when an obstacle was at a follower's place, which the follower must then leave."""

from __future__ import annotations

import numpy as np
from flockwire.domain.time import SECOND

from flockwire_analysis.phases import offsets
from flockwire_analysis.recorded import Trace
from flockwire_analysis.separation import surface_distance
from flockwire_analysis.series import Booleans, Integers
from flockwire_analysis.tracking import Errors, interpolated

RECOVERY = 4 * SECOND  # ns for a follower to return to its place


def undisturbed(trace: Trace, errors: dict[int, Errors]) -> dict[int, Errors]:
    """Return `errors` without the samples of followers whose places were near obstacles.

    A place is h_i + x_0; near means within the obstacles' influence radius. Samples within RECOVERY after it are left
    out too.
    """
    return {
        number: Errors(error.stamps[free], error.values[free])
        for number, error in errors.items()
        for free in [~_disturbed(trace, number, error.stamps)]
    }


def _disturbed(trace: Trace, number: int, stamps: Integers) -> Booleans:
    """Return at which of `stamps` (Unix ns, ascending) follower `number` is, or just was, near an obstacle."""
    if not trace.swarm.obstacles or not len(stamps):
        return np.zeros(len(stamps), np.bool_)
    places = offsets(trace, number, stamps) + interpolated(trace.positions(0), stamps)
    reach = trace.swarm.avoidance.obstacle_influence_radius
    near = np.min([surface_distance(places, obstacle) for obstacle in trace.swarm.obstacles], axis=0) < reach
    if not near.any():
        return np.asarray(near)
    last = np.where(near, stamps, 0)
    return np.asarray(stamps - np.maximum.accumulate(last) < RECOVERY)
