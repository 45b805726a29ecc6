"""The planner of one drone: it flies the shortest way among the discs of what is near (tangent_graph.py)."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, hypot
from typing import Final

from flockwire_core.control.around.bent_place import DetourParameters, stands
from flockwire_core.control.plane_polygon import Corner
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import Vector, limit, scale
from tangent_graph import Disc, Way, shortest_way

PERIOD: Final = 0.1  # s between two plans: a body moves by less than the spare distance
AHEAD: Final = 0.25  # m along the way, the point that is flown to: beyond the motion of a period
SPARE: Final = 0.02  # m beyond the kept distance: the filter must not slow down a drone on its way
SLOW: Final = 0.25  # m/s against the place, below which a drone stands in the formation
SOON: Final = 2.0  # s, at most, within which others are met, at their closest approach
LOOK_AHEAD: Final = 3.0  # s, at most, for which the place's motion is continued past an obstacle: sight ends
BERTH: Final = 0.12  # m more, where the way is hardly longer: near others the filter slows it down
LONGER: Final = 0.3  # m that this way may be longer
TIGHT: Final = 0.06  # m by which drones' radii shrink where there is no way else: they make room
RIGHT: Final = 0.1  # m by which a way to the left must be shorter: drones that meet head on choose alike


class Planner:
    """Turns one drone's corrections along its way; plans every PERIOD, the drones of a swarm by `number` in turns."""

    def __init__(self, parameters: DetourParameters, number: int) -> None:
        self._parameters = parameters
        self._planned = -PERIOD * ((number * 0.618) % 1.0)  # s, of the last plan
        self._ahead: Corner | None = None  # m from the place; None: straight
        self._soon = SOON * ((number * 0.618) % 1.0)  # s: who has the shorter one goes first
        self._length = 0.0  # m, from there

    def correction(
        self, error: Vector, motion: Motion, velocity: Vector, bodies: Sequence[Body], gain: float, now: float
    ) -> Vector:
        """Return the correction, m/s, of an `error` y − y_r, m; the place moves at `velocity`, m/s; `now` in s."""
        speed = self._parameters.speed
        if not bodies:
            self._ahead = None
            return limit(scale(error, -gain), speed)
        if now - self._planned >= PERIOD:
            self._planned += PERIOD * ((now - self._planned) // PERIOD)
            self._plan((error[0], error[1]), motion, velocity, bodies)
        if self._ahead is None:
            return limit(scale(error, -gain), speed)
        x, y = self._ahead[0] - error[0], self._ahead[1] - error[1]
        reach = hypot(x, y)
        pull = gain * (reach + self._length) / max(reach, 1e-6)
        return limit((pull * x, pull * y, -gain * error[2]), speed)

    def _plan(self, here: Corner, motion: Motion, velocity: Vector, bodies: Sequence[Body]) -> None:
        obstacles, drones = self._discs(here, motion, velocity, bodies)
        goal = (0.0, 0.0)
        way = _way(here, goal, obstacles, drones, 0.0)
        if way is None:
            way = _way(here, goal, obstacles, drones, -TIGHT) or _way(here, goal, obstacles, [], 0.0)
        else:
            wide = _way(here, goal, obstacles, drones, BERTH)
            if wide is not None and wide.length < way.length + LONGER:
                way = wide
        self._ahead = None
        if way is not None and not way.is_straight:
            self._ahead, self._length = way.ahead, max(way.length - AHEAD, 0.0)

    def _discs(
        self, here: Corner, motion: Motion, velocity: Vector, bodies: Sequence[Body]
    ) -> tuple[list[Disc], list[Disc]]:
        """Return the discs of obstacles and of drones, relative to the place."""
        own, obstacles, drones = self._parameters, list[Disc](), list[Disc]()
        (vx, vy, _), (ux, uy, _) = velocity, motion.velocity
        ox, oy = here[0] + motion.position[0] - motion.stopping[0], here[1] + motion.position[1] - motion.stopping[1]
        for body in bodies:
            (x, y, _), (wx, wy, _), r = body.relative_position, body.velocity, own.separation.from_axis(body) + SPARE
            x, y, wx, wy = x + ox, y + oy, wx - vx, wy - vy
            is_drone = body.kind is BodyKind.DRONE
            if not is_drone and stands(body):
                t = min(max(hypot(x - here[0], y - here[1]) - r, 0.0) / own.speed, LOOK_AHEAD)
                obstacles.append((x - t * vx, y - t * vy, r))
            elif is_drone and wx * wx + wy * wy < SLOW * SLOW:
                drones.append((x, y, r))
            else:
                rx, ry, cx, cy = x - here[0], y - here[1], wx - ux + vx, wy - uy + vy
                square = cx * cx + cy * cy
                t = min(max(-(rx * cx + ry * cy) / square, 0.0), self._soon) if square > 0.0 else 0.0
                if t > 0.0 and hypot(rx + t * cx, ry + t * cy) < r + BERTH:
                    (drones if is_drone else obstacles).append((x + t * wx, y + t * wy, r))
        return obstacles, drones


def _way(here: Corner, goal: Corner, obstacles: list[Disc], drones: list[Disc], more: float) -> Way | None:
    """Return the shortest way with `more` m of berth; discs never reach to where it begins and ends."""
    discs = [
        (x, y, min(r + more, dist((x, y), here) - 1e-3, dist((x, y), goal) - 1e-3))
        for group, more in ((obstacles, max(more, 0.0)), (drones, more))
        for x, y, r in group
    ]
    return shortest_way(here, goal, [disc for disc in discs if disc[2] > 0.0], AHEAD, RIGHT)
