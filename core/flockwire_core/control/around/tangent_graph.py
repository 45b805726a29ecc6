"""The tangent graph: the shortest way among discs, in the plane."""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heappop, heappush
from math import atan2, dist, hypot, pi, sqrt, tau
from typing import Final, NamedTuple

from flockwire_core.control.free_place import Disc
from flockwire_core.control.plane_polygon import Corner

LONGEST_ARC: Final = 1.2 * pi  # rad: a way that winds farther round one disc is no shortest way
MOST_EXPANSIONS: Final = 40  # of one search: bounds the cost of a step
TOUCH: Final = 1e-6  # m by which a way may enter a disc: rounding

Edge = tuple[float, float, float, float, float, float]  # where a tangent leaves and arrives, m; its unit vector
_Side = tuple[int, float]  # disc, side
_Node = tuple[int, float, Edge, int]  # disc, side, tangent that arrives, first node of the way
_Step = tuple[float, float, int, int, float, float, Edge]  # f, g, node before, disc, side, arc, tangent


class Way(NamedTuple):
    """A shortest way: its length, m, the point `ahead` m along its first tangent, and the side of its first disc.

    The point lies beyond the first disc, if that is nearer: a chord to a point on its arc would cut it. The disc is to
    the left (1) or to the right (-1) of the way; 0: it is straight.
    """

    length: float
    ahead: Corner
    side: float


def tangent(start: Disc, end: Disc) -> Edge | None:
    """Return the tangent from one circle to another one, None if there is none.

        d = c_e − c_s,   n·d = r_e − r_s,   u·d = sqrt(d² − (r_e − r_s)²),   p_k = c_k − r_k n        (ours)

    u is its direction and n the normal to the left. A radius r has a sign: > 0 where the circle lies to the left of the
    way, which goes round it counter-clockwise, < 0 to the right; 0 is a point.
    """
    ax, ay, a = start
    bx, by, b = end
    dx, dy, more = bx - ax, by - ay, b - a
    square = dx * dx + dy * dy
    along = square - more * more
    if along <= 0.0:
        return None
    along = sqrt(along)
    ux, uy = (along * dx + more * dy) / square, (along * dy - more * dx) / square
    return (ax + a * uy, ay - a * ux, bx + b * uy, by - b * ux, ux, uy)


def is_free(edge: Edge, discs: Sequence[Disc], start: int, end: int) -> bool:
    """Return whether a segment is outside all discs but those numbered `start` and `end`."""
    px, py, qx, qy, ux, uy = edge
    length = (qx - px) * ux + (qy - py) * uy
    for k in range(len(discs)):
        cx, cy, r = discs[k]
        x, y, least = cx - px, cy - py, r - TOUCH
        t = min(max(x * ux + y * uy, 0.0), length)
        x, y = x - t * ux, y - t * uy
        if least > 0.0 and x * x + y * y < least * least and k not in (start, end):
            return False
    return True


def arc(side: float, arrival: Edge, departure: Edge) -> float:
    """Return the angle, rad, that the way turns to its `side` between two tangents of one circle."""
    ux, uy, vx, vy = arrival[4], arrival[5], departure[4], departure[5]
    angle = side * atan2(ux * vy - uy * vx, ux * vx + uy * vy)
    return angle + tau if angle < -1e-9 else max(angle, 0.0)


def _is_arc_free(number: int, side: float, arrival: Edge, angle: float, discs: Sequence[Disc]) -> bool:
    """Return whether an arc of a disc, whose ends are free, is outside all others."""
    cx, cy, r = discs[number]
    ax, ay = side * arrival[5], -side * arrival[4]  # from the centre to where it begins
    for k in range(len(discs)):
        x, y, other = discs[k][0] - cx, discs[k][1] - cy, discs[k][2] - TOUCH
        square = x * x + y * y
        if k == number or square >= (r + other) * (r + other) or (other < r and square <= (r - other) * (r - other)):
            continue
        towards = side * atan2(ax * y - ay * x, ax * x + ay * y)
        if (towards if towards >= 0.0 else towards + tau) <= angle:
            return False
    return True


def shortest_way(
    start: Corner, goal: Corner, discs: Sequence[Disc], ahead: float, right: float = 0.0, turn: Corner = (0.0, 0.0)
) -> Way | None:
    """Return the shortest way from `start` to `goal`, m, outside all `discs`, None if there is none.

    A* over (disc, side): g is the length up to where the way arrives at a disc, h the straight rest. A tangent, and the
    arc before it, is tested when its turn comes. A way with its first disc to its right is longer by `right` m, and one
    round discs by |t| − t·u m, t = `turn` and u its first direction. Start and goal must be outside the discs.
    """
    at, end = (start[0], start[1], 0.0), (goal[0], goal[1], 0.0)
    straight = tangent(at, end)
    if straight is None or is_free(straight, discs, -1, -1):  # so are 19 ways of 20: a tenth of a search's time
        part = ahead / max(length := dist(start, goal), ahead)
        return Way(length, (start[0] + part * (goal[0] - start[0]), start[1] + part * (goal[1] - start[1])), 0.0)
    targets = [(k, to, (x, y, to * r)) for k, (x, y, r) in enumerate(discs) for to in (1.0, -1.0)]
    targets.append((len(discs), 0.0, end))
    queue, closed = list[_Step](), set[_Side]()
    nodes: list[_Node] = [(-1, 0.0, straight, 0)]  # settled; first the start, where the way turns by nothing
    g, here, side, arrival = 0.0, -1, 0.0, straight
    while len(nodes) <= MOST_EXPANSIONS:
        for k, to, circle in targets:
            if (k, to) in closed or (edge := tangent(at, circle)) is None:  # none to itself
                continue
            angle = arc(side, arrival, edge)
            if angle <= LONGEST_ARC:
                length = g + abs(at[2]) * angle + hypot(edge[2] - edge[0], edge[3] - edge[1])
                if here < 0 and to:
                    length += hypot(turn[0], turn[1]) - turn[0] * edge[4] - turn[1] * edge[5] + right * max(-to, 0.0)
                rest = hypot(goal[0] - edge[2], goal[1] - edge[3])
                heappush(queue, (length + rest, length, len(nodes) - 1, k, to, angle, edge))
        if (step := _next_step(queue, closed, nodes, discs)) is None:
            return None
        _, g, before, here, side, _, arrival = step
        nodes.append((here, side, arrival, nodes[before][3] or len(nodes)))
        if here == len(discs):
            _, side, (px, py, _, _, ux, uy), _ = nodes[nodes[-1][3]]
            return Way(g, (px + ahead * ux, py + ahead * uy), side)
        closed.add((here, side))
        at = (discs[here][0], discs[here][1], side * discs[here][2])
    return None


def _next_step(queue: list[_Step], closed: set[_Side], nodes: list[_Node], discs: Sequence[Disc]) -> _Step | None:
    """Take from the queue up to the first step that is free and leads to what is not settled."""
    while queue:
        step = heappop(queue)
        _, _, before, k, to, turn, edge = step
        disc, side, arrival, _ = nodes[before]
        if (k, to) in closed or not is_free(edge, discs, disc, k):
            continue
        if turn == 0.0 or _is_arc_free(disc, side, arrival, turn, discs):
            return step
    return None
