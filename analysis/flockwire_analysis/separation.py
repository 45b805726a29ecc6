"""Distances between drones, to obstacles and outside the fence, and speeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.tables import Obstacle

from flockwire_analysis.phases import Span
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Booleans, Floats, Integers
from flockwire_analysis.tracking import norms, places


def common_times(span: Span, rate: int = 100) -> Integers:
    """Return `rate` instants per s of `span`, Unix ns."""
    return np.arange(span.begin, span.end + 1, SECOND // rate, dtype=np.int64)


def pair_distances(trace: Trace, times: Integers) -> Iterator[tuple[int, int, Floats]]:
    """Yield any two airframes i, j and |x_i - x_j| in m at `times` (Unix ns), NaN where one is unknown.

    One pair after the other: those of a thousand drones do not fit into memory.
    """
    known = {number: places(trace, number, times) for number in trace.flying}
    for i, j in combinations(trace.flying, 2):
        yield i, j, norms(known[i] - known[j])


def nearest_drones(trace: Trace, times: Integers) -> dict[int, Floats]:
    """Return each airframe's distance in m to the nearest other one at `times`, NaN where none is known."""
    nearest = {number: np.full(len(times), np.nan) for number in trace.flying}
    for i, j, distances in pair_distances(trace, times):
        for one in (i, j):
            np.fmin(nearest[one], distances, out=nearest[one])
    return nearest


def nearest_to(trace: Trace, number: int, now: int) -> int:
    """Return the airframe that is nearest to airframe `number` at `now`, Unix ns; raises ValueError without one."""
    others = {i: places(trace, i, np.array([now], np.int64)) for i in trace.flying}
    own = others.pop(number)
    squares = {i: float(np.sum((place - own) ** 2)) for i, place in others.items()}
    return min((i for i, square in squares.items() if np.isfinite(square)), key=squares.__getitem__)


def obstacle_distances(trace: Trace, times: Integers) -> dict[int, Floats]:
    """Return each airframe's distance in m to the nearest obstacle's surface at `times`, NaN if it is unknown."""
    return {i: nearest_surface(places(trace, i, times), trace.swarm.obstacles) for i in trace.flying}


def mover_distances(trace: Trace, span: Span) -> dict[int, Floats]:
    """Return each airframe's published distances in m to the nearest moving body that is not a drone."""
    nearby = {number: trace.of("nearby", number) for number in trace.flying}
    return {number: series.values[span.holds(series.stamps), 0] for number, series in nearby.items()}


def surface_distance(points: Floats, obstacle: Obstacle) -> Floats:
    """Return the distance in m from `points` (m, shape n x 3) to an obstacle's surface, negative inside.

    The cylinder is on the ground (z = 0); without a height only the horizontal distance counts.
    """
    x, y, _ = obstacle.center
    aside: Floats = np.hypot(points[:, 0] - x, points[:, 1] - y) - obstacle.radius
    if obstacle.height is None:
        return aside
    above = points[:, 2] - obstacle.height
    outside: Floats = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
    return outside + np.minimum(np.maximum(aside, above), 0.0)


def nearest_surface(points: Floats, obstacles: Sequence[Obstacle]) -> Floats:
    """Return the distance in m from `points` (m, shape n x 3) to the nearest of the obstacles' surfaces."""
    return np.asarray(np.min([surface_distance(points, obstacle) for obstacle in obstacles], axis=0))


def max_outside(trace: Trace, span: Span) -> float | None:
    """Return the largest distance of a flying airframe outside `limits.fence` within `span`, m (0 inside).

    The walls of a polygon are checked ten times a second.
    """
    polygon_step = 0.1  # s between two checks of the walls of a fence's polygon
    room = trace.swarm.limits.fence.room()
    found = []
    for number in trace.flying:
        series = trace.positions(number)
        points = series.values[span.holds(series.stamps) & _in_the_air(trace, number, series.stamps)]
        if not len(points):
            continue
        beyond = np.maximum(np.array(room.low) - points, points - np.array(room.high))
        found.append(max(0.0, float(beyond.max())))
        if room.corners:
            every = max(1, round(len(series) * polygon_step * SECOND / max(1, series.stamps[-1] - series.stamps[0])))
            found += [room.outside((x, y, z)) for x, y, z in points[::every].tolist()]
    return max(found, default=None)


def max_speed(trace: Trace, span: Span) -> float | None:
    """Return the highest speed of any airframe within `span`, m/s, from displacements over about 50 ms."""
    window = SECOND // 20  # ns, of a speed
    found = []
    for number in trace.flying:
        series = trace.positions(number)
        within = span.holds(series.stamps)
        stamps, points = series.stamps[within], series.values[within]
        after = np.searchsorted(stamps, stamps + window)
        first = np.flatnonzero(after < len(stamps))
        lasted = stamps[after[first]] - stamps[first]
        moved = norms(points[after[first]] - points[first])
        found.append((moved * SECOND / lasted)[lasted < 4 * window])  # unknown across a gap
    return max((float(speeds.max()) for speeds in found if len(speeds)), default=None)


def smallest(distances: list[Floats]) -> float | None:
    """Return the smallest of all known distances, None when there is none."""
    known = [values[np.isfinite(values)] for values in distances]
    return min((float(values.min()) for values in known if len(values)), default=None)


def _in_the_air(trace: Trace, number: int, stamps: Integers) -> Booleans:
    """Return at which of `stamps` (Unix ns) the newest telemetry reported an airframe off the ground."""
    telemetry = trace.of("telemetry", number)
    if not len(telemetry):
        return np.ones(len(stamps), np.bool_)
    newest = np.maximum(np.searchsorted(telemetry.stamps, stamps, "right") - 1, 0)
    return np.asarray(telemetry.values[newest, 0] != FlightState.GROUNDED)


def cannot_be_had(trace: Trace, points: Floats) -> Booleans:
    """Return which `points` (m, shape n x 3) are nearer to an obstacle than the filter keeps, or outside the fence."""
    found = outside_fence(trace, points)
    for obstacle in trace.swarm.obstacles:
        found |= surface_distance(points, obstacle) < trace.swarm.avoidance.kept.obstacle
    return found


def outside_fence(trace: Trace, points: Floats) -> Booleans:
    """Return which of `points` (m, shape n x 3) are outside the fence."""
    room = trace.swarm.limits.fence.room()
    found = np.any((points < np.array(room.low)) | (points > np.array(room.high)), axis=1)
    if room.corners:
        found |= [room.outside((x, y, z)) > 0.0 for x, y, z in points.tolist()]
    return np.asarray(found)
