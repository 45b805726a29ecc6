"""Samples a formation before it is accepted: speeds, accelerations, distances, extent."""

from dataclasses import dataclass
from itertools import islice
from math import dist, inf
from operator import itemgetter

from flockwire_core.control.formation import Formation
from flockwire_core.domain.vector import Vector, norm


@dataclass(frozen=True, slots=True)
class Survey:
    """Extremes of a formation over a sampled time span.

    `max_speed` is the largest |h_i'| in m/s, `max_acceleration` the largest |h_i''| in m/s^2, `min_distance` the
    smallest |h_i − h_j| and `min_distance_leader` the smallest |h_i| in m (the former inf for a single follower), `low`
    and `high` the corners of the box of all h_i in m.
    """

    max_speed: float
    max_acceleration: float
    min_distance: float
    min_distance_leader: float
    low: Vector
    high: Vector


def survey(formation: Formation, horizon: float, samples: int) -> Survey:
    """Sample a formation at `samples` >= 1 equidistant times from 0 to `horizon` (s) and return its extremes.

    Times between two samples are not checked: choose a period shorter than the loss of a clearance.
    """
    max_speed, max_acceleration, min_distance, min_distance_leader = 0.0, 0.0, inf, inf
    before, step = list[Vector](), horizon / max(samples - 1, 1)
    low, high = (inf, inf, inf), (-inf, -inf, -inf)
    ranks = range(formation.count)
    for k in range(samples):
        t = k * step
        points = [formation.offset(index, t) for index in ranks]
        rates = [formation.offset_rate(index, t) for index in ranks]
        max_speed = max(max_speed, *map(norm, rates))
        max_acceleration = max([max_acceleration, *(dist(*pair) / step for pair in zip(before, rates, strict=False))])
        before = rates
        min_distance = _smallest_distance(points, min_distance)
        min_distance_leader = min(min_distance_leader, *(norm(point) for point in points))
        xs, ys, zs = zip(*points, strict=True)
        low = (min(low[0], *xs), min(low[1], *ys), min(low[2], *zs))
        high = (max(high[0], *xs), max(high[1], *ys), max(high[2], *zs))
    return Survey(max_speed, max_acceleration, min_distance, min_distance_leader, low, high)


def _smallest_distance(points: list[Vector], best: float) -> float:
    """Return the smallest pairwise distance, or `best` if that is smaller: a sweep along the widest axis."""
    low, high = (tuple(map(extreme, zip(*points, strict=True))) for extreme in (min, max))
    axis = max(range(3), key=lambda k: high[k] - low[k])
    swept = sorted(points, key=itemgetter(axis))
    for i, point in enumerate(swept, 1):
        place = point[axis]
        for other in islice(swept, i, None):
            if other[axis] - place >= best:
                break
            if (gap := dist(point, other)) < best:
                best = gap
    return best
