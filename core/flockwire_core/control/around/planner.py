"""The planner of one drone: towards its place, along the shortest way among the discs of what is near.

    u = v + K (a − e) (|a − e| + l) / |a − e|,   |u − v| <= v_max        (ours)

a is the point AHEAD m along the first tangent of the way (tangent_graph.py), l the length of the rest, e the drone's
error, all relative to the place, which moves at v. All bodies are discs where they will be when the drone is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, dist, hypot, sqrt
from typing import Final

from flockwire_core.control.around.lateral_shift import lateral_shift
from flockwire_core.control.around.tangent_graph import TOUCH, Way, shortest_way
from flockwire_core.control.free_place import Disc, is_free, nearest_free_place
from flockwire_core.control.guard import GuardParameters
from flockwire_core.control.plane_polygon import Corner
from flockwire_core.domain.body import AT_REST, Body, BodyKind, stands
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, limit, subtract

PERIOD: Final = 0.1  # s between two plans: a body moves by less than the spare distance
AHEAD: Final = 0.25  # m along the first tangent, the point that is flown to: beyond the motion of a period
SPARE: Final = 0.03  # m beyond the kept distance: the filter must not slow down a drone on its way
SLOW: Final = 0.25  # m/s against the place, below which a drone stands in the formation
SOON: Final = 1.0  # s, at most, for which a motion is continued: then it has changed
BERTH: Final = 0.12  # m more, where the way is hardly longer (half beside a fast place): there the filter slows it
RIGHT: Final = 0.1  # m by which a way to the left must be shorter
LITTLE: Final = 0.3  # m more: so long a way keeps more berth, begins as the last one did, or passes on the same side
STEADY: Final = 0.3  # of a change of the place's velocity that counts at a plan: a leader that weaves changes no side
SIDEWAYS: Final = 0.4  # of the speed limit, at which a place leaves the way of a body
ROUND: Final = 0.5  # m that a way round drones may be longer than one above or below, for each that it would cross
EAST: Final = (0.8, 0.6)  # of two that pass so, the one on this side flies lower
MOST_KNOWN: Final = 32  # obstacles, besides those in sight: bounds the cost of a step
MOST_AHEAD: Final = 6  # discs of a mover, and obstacles out of sight that a place passes, likewise

Near = tuple[Sequence[Disc], Sequence[Disc]]  # obstacles; drones
Pass = tuple[float, float, list[Disc], float]  # velocity at which a place passes discs, m/s; s that it is early


class Planner:
    """Leads one drone to its place along a way at the distances of its safety filter, `guard`; `gain` is K, 1/s.

    It plans every PERIOD, the drones of a swarm by `number` in turns.
    """

    def __init__(self, guard: GuardParameters, gain: float, number: int) -> None:
        self._guard, self._gain = guard, gain
        self._bend = (guard.slowness + 1.0 / guard.rate) / (2.0 * guard.rate)  # s^2, docs/theory.md, section 6
        self._planned = -PERIOD * ((number * 0.618) % 1.0)  # s, of the last plan
        self._known: list[Disc] = []  # the obstacles that it has seen, the centres in the world frame
        self._left: list[Disc] = []  # those of them that are out of sight
        self._steady: Corner = (0.0, 0.0)  # m/s, the place's velocity
        self._forget()

    def _forget(self) -> None:
        self._ahead, self._rate = (0.0, 0.0), (0.0, 0.0)  # m from the place, what is flown to; its velocity, m/s
        self._rest, self._passes = 0.0, False  # m, the way from there; whether it passes above or below drones
        self._turn = (0.0, 0.0)  # m, LITTLE along the last way
        self._side = 0.0  # on which the place passes what stands: 1 left, -1 right, 0 neither

    def correction(self, error: Vector, motion: Motion, velocity: Vector, bodies: Sequence[Body], now: float) -> Vector:
        """Return u − v, m/s, for an `error` y − y_r, m, of the stopping point; the place moves at `velocity`, m/s.

        `bodies` are relative to the position, m; `now` in s.
        """
        x, y, z = error
        if now - self._planned >= PERIOD:
            self._planned += PERIOD * ((now - self._planned) // PERIOD)
            vx, vy = self._steady
            self._steady = (vx + STEADY * (velocity[0] - vx), vy + STEADY * (velocity[1] - vy))
            if bodies or self._guard.room.outside(subtract(motion.stopping, error)) > 0.0:
                self._plan((x, y), motion, velocity, bodies)
            else:
                self._forget()
        vx, vy = self._rate
        t = now - self._planned
        x, y = self._ahead[0] + t * vx - x, self._ahead[1] + t * vy - y
        reach, rise = sqrt(x * x + y * y), self._rise(z, (x, y), bodies) if self._passes else 0.0
        pull = self._gain * (1.0 + self._rest / max(reach, 1e-6))
        return limit((pull * x + vx, pull * y + vy, self._gain * (rise - z)), self._guard.speed)

    def _rise(self, z: float, along: Corner, bodies: Sequence[Body]) -> float:
        """Return the height, m above the place, that keeps clear of the nearest drone ahead.

        Two that meet see each other in opposite directions: one flies above. Who is on its own level flies its way.
        """
        kept, nearest, rise = self._guard.separation.drone + SPARE, 2.0 * SOON * self._guard.speed, 0.0
        for body in bodies:
            x, y, up = body.relative_position
            gap, side = sqrt(x * x + y * y), 1.0 if x * EAST[0] + y * EAST[1] > 0.0 else -1.0
            ahead = gap < kept or x * along[0] + y * along[1] > 0.0
            if body.kind is BodyKind.DRONE and gap < nearest and ahead and side * (z + up) < 0.25 * kept:
                nearest, rise = gap, z + up + side * kept
        return rise

    def _plan(self, here: Corner, motion: Motion, velocity: Vector, bodies: Sequence[Body]) -> None:
        """Plan from `here`, m from the place."""
        self._remember(motion.position, bodies)
        near, passed = self._discs(here, motion, velocity, bodies)
        goal = self._goal(here, motion, passed, near, 0.0)
        way = self._best_way(here, goal, near)
        if way is None or not way.side:
            (x, y), self._ahead, self._rest = self._goal(here, motion, passed, near, PERIOD), goal, 0.0
            rate = ((x - goal[0]) / PERIOD, (y - goal[1]) / PERIOD)
            self._rate = rate if hypot(*rate) < self._guard.speed else (0.0, 0.0)  # else the side has changed
        else:
            self._ahead, self._rate, self._rest = way.ahead, (0.0, 0.0), max(way.length - AHEAD, 0.0)
        x, y = here if way is None else way.ahead
        self._turn = (LITTLE / AHEAD * (x - here[0]), LITTLE / AHEAD * (y - here[1]))

    def _best_way(self, here: Corner, goal: Corner, near: Near) -> Way | None:
        """Return the way, with more berth where it is hardly longer; note whether it passes above or below drones."""
        wide = self._way(here, goal, near, BERTH)
        if wide is not None and not wide.side:
            self._passes = False
            return wide  # straight, as all are then
        direct = self._way(here, goal, (near[0], ()), 0.0)
        way = self._way(here, goal, near, 0.0) if near[1] else direct
        self._passes = direct is not None and (way is None or way.length > direct.length + self._more(here, goal, near))
        if self._passes or way is None:
            return direct
        return wide if wide is not None and wide.length < way.length + LITTLE else way

    def _more(self, here: Corner, goal: Corner, near: Near) -> float:
        """Return how much longer, m, a way round drones may be; less if the last one passed above or below them."""
        ways = [self._way(here, goal, ((), (one,)), 0.0) for one in near[1]]
        crossed = len([way for way in ways if way is None or way.side])
        return ROUND * max(crossed, 1) - (LITTLE if self._passes else 0.0)

    def _remember(self, position: Vector, bodies: Sequence[Body]) -> None:
        """Note the obstacles in sight, before those that have left it: a dead end is not entered again."""
        (x, y, _), sight, kept = position, self._guard.sight, self._guard.separation.obstacle
        seen = [
            (x + body.relative_position[0], y + body.relative_position[1], self._guard.separation.from_axis(body))
            for body in bodies
            if body.kind is BodyKind.OBSTACLE and body.velocity == ZERO
        ]
        self._left = [
            one
            for one in self._known
            if dist(one[:2], (x, y)) - one[2] > sight - kept and all(dist(one[:2], two[:2]) > SPARE for two in seen)
        ][:MOST_KNOWN]
        self._known = seen + self._left

    def _discs(self, here: Corner, motion: Motion, velocity: Vector, bodies: Sequence[Body]) -> tuple[Near, list[Pass]]:
        """Return the discs of obstacles and of drones, relative to the place, and what the place passes."""
        own, obstacles, drones, fixed = self._guard, list[Disc](), list[Disc](), list[Disc]()
        passed, standing = list[Pass](), list[Disc]()
        (vx, vy, _), (ux, uy, _) = velocity, limit((-self._gain * here[0], -self._gain * here[1], 0.0), own.speed)
        px, py = motion.position[0] - motion.stopping[0], motion.position[1] - motion.stopping[1]
        for body in bodies:
            (x, y, _), (wx, wy, _), r = body.relative_position, body.velocity, own.separation.from_axis(body) + SPARE
            x, y, wx, wy = x + px, y + py, wx - vx, wy - vy
            at = (x + here[0], y + here[1], r)
            if stands(body):
                fixed.append(at)
                standing.append((x, y, r))
            elif body.kind is BodyKind.MOVER:
                early = 1.0 / own.rate  # s, of the filter; 0.4 s more, so that nobody wonders whether it will
                passed.append((-wx, -wy, [at], early + 0.4))
                step = r / hypot(*body.velocity[:2])  # s
                for k in range(min(1 + ceil((early + 2.0 * r / own.speed) / step), MOST_AHEAD)):
                    obstacles.append((at[0] + k * step * wx, at[1] + k * step * wy, r))
            elif wx * wx + wy * wy < SLOW * SLOW:
                drones.append(at)
            else:
                cx, cy = wx - ux, wy - uy  # by the straight way's u, that no turn of its own changes
                square = cx * cx + cy * cy
                t = min(max(-(x * cx + y * cy) / square, 0.0), SOON) if square > 0.0 else 0.0
                if t > 0.0 and hypot(x + t * cx, y + t * cy) < r + BERTH:
                    drones.append((at[0] + t * wx, at[1] + t * wy, r))
        times = together(standing, [min(max(hypot(x, y) - r, 0.0) / own.speed, SOON) for x, y, r in standing])
        obstacles += [(x - t * vx, y - t * vy, r) for (x, y, r), t in zip(fixed, times, strict=True)]
        ox, oy = here[0] - motion.stopping[0], here[1] - motion.stopping[1]
        left = [(x + ox, y + oy, r + SPARE) for x, y, r in self._left]
        obstacles += left
        fixed += sorted(left, key=lambda disc: hypot(disc[0], disc[1]) - disc[2])[:MOST_AHEAD]
        return (obstacles, drones), [(self._steady[0], self._steady[1], fixed, 0.0), *passed]

    def _goal(self, here: Corner, motion: Motion, passed: Sequence[Pass], near: Near, t: float) -> Corner:
        """Return what to fly to in `t` s, m from the place: itself, beside what it passes, or the nearest free one."""
        goal, room, fixed = (0.0, 0.0), self._guard.room, list[Disc]()
        ox, oy = motion.stopping[0] - here[0], motion.stopping[1] - here[1]
        for one in passed:
            if hypot(one[0], one[1]) < AT_REST:
                fixed += one[2]
            else:
                goal = self._beside(goal, here, one, near, t)
        place = (goal[0] + ox, goal[1] + oy)
        if is_free(goal, fixed) and room.outside((*place, room.low[2])) <= 0.0:
            return goal
        x, y = nearest_free_place(place, [(x + ox, y + oy, r) for x, y, r in fixed], room) or place
        return (x - ox, y - oy)

    def _beside(self, goal: Corner, here: Corner, passed: Pass, near: Near, t: float) -> Corner:
        """Return `goal` beside what it passes, on the side with the shorter way, away from drones; keep that side."""
        (vx, vy, discs, early), found = passed, list[tuple[float, float, Corner]]()
        (x, y), speed = goal, hypot(vx, vy)
        along, slope = (vx / speed, vy / speed), SIDEWAYS * self._guard.speed / speed
        if not early:  # a mover is met earlier instead
            bend = speed * speed * (1.0 + slope * slope) * self._bend
            discs = [(cx, cy, r - SPARE + min(bend / r, 0.5 * BERTH)) for cx, cy, r in discs]
        for side in (-1.0, 1.0):
            shift, most = lateral_shift((x + t * vx, y + t * vy), along, discs, side, slope, early * speed)
            there = (x - side * most * along[1], y + side * most * along[0])
            way = self._way(here, there, (near[0], ()), 0.0) if most > 0.0 else None
            cost = most + (dist(here, there) if way is None else way.length) + (RIGHT if side > 0.0 else 0.0)
            cost += 2.0 * LITTLE if side == -self._side and not early else 0.0
            cost += 2.0 * sum([max(r - dist(there, (cx, cy)), 0.0) for cx, cy, r in near[1]])
            shifted = (x - side * shift * along[1], y + side * shift * along[0])
            found.append((cost, side if most > 0.0 else 0.0, shifted))
        _, side, goal = min(found)
        self._side = self._side if early else side
        return goal

    def _way(self, here: Corner, goal: Corner, near: Near, berth: float) -> Way | None:
        """Return the shortest way with `berth` m more; discs never reach to where it begins and ends."""
        kept = [
            (x, y, min(r + berth, dist((x, y), here) - 2.0 * TOUCH, dist((x, y), goal) - 2.0 * TOUCH))
            for x, y, r in (*near[0], *near[1])
        ]
        right = 2.0 * LITTLE if near[1] else RIGHT  # all who meet choose alike
        return shortest_way(here, goal, [disc for disc in kept if disc[2] > 0.0], AHEAD, right, self._turn)


def together(discs: Sequence[Disc], times: list[float]) -> list[float]:
    """Return the times of `discs`, of those that touch the first: a gap that is closed stays closed."""
    pairs = [(i, j) for i, a in enumerate(discs) for j, b in enumerate(discs) if dist(a[:2], b[:2]) < a[2] + b[2]]
    while (late := next(((i, j) for i, j in pairs if times[i] < times[j]), None)) is not None:
        times[late[1]] = times[late[0]]
    return times
