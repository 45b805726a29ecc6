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
        for j in range(i + 1, len(every)):
            beside = j == i + 1 or (i == 0 and j == last)
            if _folded(one, every[j]) if beside else _meet(one, every[j]):
                return i, j
    return None


def _meet(one: tuple[Corner, Corner], other: tuple[Corner, Corner]) -> bool:
    """Return whether two edges have a point in common."""
    sides = [_side(one, end) for end in other], [_side(other, end) for end in one]
    if all(pair[0] * pair[1] < 0.0 for pair in sides):
        return True
    return any(
        side == 0.0 and _within(edge, end)
        for edge, ends, pair in ((one, other, sides[0]), (other, one, sides[1]))
        for end, side in zip(ends, pair, strict=True)
    )


def _folded(one: tuple[Corner, Corner], other: tuple[Corner, Corner]) -> bool:
    """Return whether one of two edges with a common corner leads back along the other."""
    common = one[1] if one[1] == other[0] else one[0]
    (ax, ay), (bx, by) = (_other_end(edge, common) for edge in (one, other))
    ux, uy, vx, vy = ax - common[0], ay - common[1], bx - common[0], by - common[1]
    return ux * vy - uy * vx == 0.0 and ux * vx + uy * vy > 0.0


def _other_end(edge: tuple[Corner, Corner], corner: Corner) -> Corner:
    return edge[1] if edge[0] == corner else edge[0]


def _side(edge: tuple[Corner, Corner], point: Corner) -> float:
    (ax, ay), (bx, by) = edge
    return (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)


def _within(edge: tuple[Corner, Corner], point: Corner) -> bool:
    return all(min(a, b) <= p <= max(a, b) for a, b, p in zip(*edge, point, strict=True))
