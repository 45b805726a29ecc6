"""Samples a formation before it is accepted: speeds, distances, extent."""

from dataclasses import dataclass
from itertools import islice
from math import dist, inf
from operator import itemgetter

from flockwire.control.formation import Formation
from flockwire.domain.vector import ZERO, Vector, norm


@dataclass(frozen=True, slots=True)
class Survey:
    """Extremes of a formation over a sampled time span.

    `max_speed` is the largest |h_i'| in m/s, `min_distance` the smallest |h_i − h_j| and `min_distance_leader` the
    smallest |h_i| in m (the former inf for a single follower), `extent` the largest |x|, |y|, |z| of h_i in m.
    """

    max_speed: float
    min_distance: float
    min_distance_leader: float
    extent: Vector


def survey(formation: Formation, horizon: float, samples: int) -> Survey:
    """Sample a formation at `samples` >= 1 equidistant times from 0 to `horizon` (s) and return its extremes.

    Times between two samples are not checked: choose a period shorter than the loss of a clearance.
    """
    max_speed, min_distance, min_distance_leader = 0.0, inf, inf
    extent = ZERO
    ranks = range(formation.count)
    for k in range(samples):
        t = horizon * k / max(samples - 1, 1)
        points = [formation.offset(index, t) for index in ranks]
        max_speed = max(max_speed, *(norm(formation.offset_rate(index, t)) for index in ranks))
        min_distance = _smallest_distance(points, min_distance)
        min_distance_leader = min(min_distance_leader, *(norm(point) for point in points))
        extent = _widened(extent, points)
    return Survey(max_speed, min_distance, min_distance_leader, extent)


def _widened(extent: Vector, points: list[Vector]) -> Vector:
    return (
        max(extent[0], *(abs(x) for x, _, _ in points)),
        max(extent[1], *(abs(y) for _, y, _ in points)),
        max(extent[2], *(abs(z) for _, _, z in points)),
    )


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
