"""A polygon in the horizontal plane, convex or not: distance of a point from its boundary, and self-crossing."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import hypot

Corner = tuple[float, float]


def edges(corners: tuple[Corner, ...]) -> Iterator[tuple[Corner, Corner]]:
    """Yield the edges, the last one back to the first corner."""
    return pairwise((*corners, corners[0]))


def nearest_on_edge(point: Corner, edge: tuple[Corner, Corner]) -> Corner:
    """Return the point of `edge` that is nearest to `point`."""
    (px, py), ((ax, ay), (bx, by)) = point, edge
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    share = ((px - ax) * dx + (py - ay) * dy) / square if square > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return (ax + share * dx, ay + share * dy)


def contains(corners: tuple[Corner, ...], point: Corner) -> bool:
    """Return whether `point` is inside, by the even-odd rule: a ray to +X crosses the boundary oddly often."""
    x, y = point
    inside = False
    for (ax, ay), (bx, by) in edges(corners):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return inside


def clearance(corners: tuple[Corner, ...], point: Corner) -> tuple[float, Corner]:
    """Return the distance to the boundary, negative outside, and the unit vector straight inwards."""
    nearest, edge, distance = point, (point, point), float("inf")
    for each in edges(corners):
        candidate = nearest_on_edge(point, each)
        away = hypot(point[0] - candidate[0], point[1] - candidate[1])
        if away < distance:
            nearest, edge, distance = candidate, each, away
    inside = contains(corners, point)
    if distance <= 1e-9:  # m: it is on the boundary
        return 0.0, inward_normal(corners, edge)
    sign = 1.0 if inside else -1.0
    way = (sign * (point[0] - nearest[0]) / distance, sign * (point[1] - nearest[1]) / distance)
    return sign * distance, way


def inward_normal(corners: tuple[Corner, ...], edge: tuple[Corner, Corner]) -> Corner:
    """Return the unit normal of `edge` that leads inwards."""
    (ax, ay), (bx, by) = edge
    length = hypot(bx - ax, by - ay)
    turn = 1.0 if area(corners) > 0.0 else -1.0
    return (-turn * (by - ay) / length, turn * (bx - ax) / length)


def area(corners: tuple[Corner, ...]) -> float:
    """Return the area, m^2, negative if the corners are clockwise."""
    return 0.5 * sum(ax * by - bx * ay for (ax, ay), (bx, by) in edges(corners))


def crossing(corners: tuple[Corner, ...]) -> tuple[int, int] | None:
    """Return the numbers of two edges that meet outside a common corner, None if there are none."""
    every = tuple(edges(corners))
    last = len(every) - 1
    for i, one in enumerate(every):
        for j, other in enumerate(every[i + 1 :], i + 1):
            ends = [(one[0], other), (other[1], (one[1], one[0])), (one[1], (other[1], other[0])), (other[0], one)]
            if j == i + 1:
                ends = ends[:2]  # without the common corner
            elif (i, j) == (0, last):
                ends = ends[2:]
            if _cross(one, other) or any(_is_on(end, edge) for end, edge in ends):
                return i, j
    return None


def _cross(one: tuple[Corner, Corner], other: tuple[Corner, Corner]) -> bool:
    return all(_side(edge, p) * _side(edge, q) < 0.0 for edge, (p, q) in ((one, other), (other, one)))


def _is_on(point: Corner, edge: tuple[Corner, Corner]) -> bool:
    within = all(min(a, b) <= p <= max(a, b) for a, b, p in zip(*edge, point, strict=True))
    return within and _side(edge, point) == 0.0


def _side(edge: tuple[Corner, Corner], point: Corner) -> float:
    (ax, ay), (bx, by) = edge
    return (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)
