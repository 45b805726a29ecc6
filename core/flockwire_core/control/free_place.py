"""The landing place of a drone: its own place or, above a body, the nearest free place in the horizontal plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import dist, hypot, sqrt
from typing import Final

from flockwire_core.control.fence import Room
from flockwire_core.control.plane_polygon import Corner, nearest_on_edge
from flockwire_core.domain.body import Body, Separation
from flockwire_core.domain.vector import Vector

Disc = tuple[float, float, float]
"""(x, y, r): the points nearer to (x, y) than r, m."""

SPARE: Final = 0.1  # m beyond the safety distance: the tracker's noise must not occupy a chosen place again
_FAR: Final = 1e150  # wall lengths from a wall to a disc; the square of a larger number raises OverflowError
_TOLERANCE: Final = 1e-9  # m, tolerance of discs and the room for rounding


def landing_place(
    position: Vector, place: Vector, bodies: Sequence[Body], separation: Separation, room: Room
) -> tuple[Vector, bool]:
    """Return the landing place, and whether the way down from `position` is free.

    It is `place` (m, world frame) or, if that or the way down is occupied, the free place nearest to `position`.
    `bodies` are relative to `position`; those above it are not in the way. If no place is free, even without SPARE, it
    is `place`, straight down: the safety filter still avoids bodies.
    """
    if not bodies:
        return place, True
    x, y, _ = position
    discs = _discs((x, y), bodies, separation)
    free = is_free((x, y), discs)
    if free and is_free((place[0], place[1]), discs):
        return place, True
    chosen = nearest_free_place((x, y), [(a, b, r + SPARE) for a, b, r in discs], room)
    if chosen is None:
        chosen = nearest_free_place((x, y), discs, room)
    if chosen is None:
        return place, True
    return (chosen[0], chosen[1], place[2]), free


def meets(bodies: Sequence[Body], separation: Separation, above: bool) -> bool:
    """Return whether one of `bodies` is in the way straight down, or up to those `above`.

    Drones are above; obstacles and spaces of lost bodies begin at the ground.
    """
    return not is_free((0.0, 0.0), _discs((0.0, 0.0), bodies, separation, above))


def _discs(place: Corner, bodies: Sequence[Body], separation: Separation, above: bool = False) -> list[Disc]:
    """Return the discs that the `bodies` occupy that are `above`, or are not; they are relative to `place`, m."""
    return [
        (place[0] + body.relative_position[0], place[1] + body.relative_position[1], separation.from_axis(body))
        for body in bodies
        if (body.relative_position[2] > 0.0) is above
    ]


def is_free(place: Corner, discs: Sequence[Disc]) -> bool:
    """Return whether `place`, m, is outside every disc."""
    px, py = place
    for x, y, r in discs:  # a loop: this is on the 100 Hz path
        dx, dy, least = px - x, py - y, r - _TOLERANCE
        if dx * dx + dy * dy < least * least:
            return False
    return True


def nearest_free_place(place: Corner, discs: Sequence[Disc], room: Room) -> Corner | None:
    """Return the free point of the room that is nearest to `place` (m, world frame), None if there is none.

        minimise |p − place|   subject to   |p − c_k| >= r_k for every disc k,   p in the room        (ours)

    It is `place` itself, the nearest point of one circle or wall, or a point where two of them meet.
    """
    walls = tuple(room.walls())
    candidates = [place, *(nearest_on_edge(place, wall) for wall in walls), *(wall[0] for wall in walls)]
    candidates += [_nearest_on_circle(place, disc) for disc in discs]
    for one, other in combinations(discs, 2):
        candidates += _circles_meet(one, other)
    for disc in discs:
        for wall in walls:
            candidates += _circle_meets(disc, wall)
    candidates.sort(key=lambda point: dist(point, place))
    low = room.low[2]
    for x, y in candidates:
        if is_free((x, y), discs) and room.outside((x, y, low)) <= _TOLERANCE:
            return (x, y)
    return None


def _nearest_on_circle(place: Corner, disc: Disc) -> Corner:
    x, y, r = disc
    dx, dy = place[0] - x, place[1] - y
    length = hypot(dx, dy)
    return (x + r * dx / length, y + r * dy / length) if length > 0.0 else (x + r, y)


def _circles_meet(one: Disc, other: Disc) -> Iterator[Corner]:
    (ax, ay, a), (bx, by, b) = one, other
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    if square == 0.0:
        return
    along = 0.5 * (1.0 + (a * a - b * b) / square)
    beside = a * a / square - along * along
    if beside < 0.0:
        return
    for across in (sqrt(beside), -sqrt(beside)):
        yield (ax + along * dx - across * dy, ay + along * dy + across * dx)


def _circle_meets(disc: Disc, wall: tuple[Corner, Corner]) -> Iterator[Corner]:
    """Yield where a circle meets a wall."""
    (cx, cy, r), ((ax, ay), (bx, by)) = disc, wall
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    if square == 0.0:
        return
    foot = ((cx - ax) * dx + (cy - ay) * dy) / square
    aside = ((cx - ax) * dy - (cy - ay) * dx) / square
    if abs(aside) > _FAR:
        return
    beside = r * r / square - aside**2
    if beside < 0.0:
        return
    for share in (foot - sqrt(beside), foot + sqrt(beside)):
        if 0.0 <= share <= 1.0:
            yield (ax + share * dx, ay + share * dy)
