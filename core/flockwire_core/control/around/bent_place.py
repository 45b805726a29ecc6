"""The bent place: a place that leads through bodies passes beside them, before the drone is there."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, hypot, sqrt
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.control.around.free_place import Disc, nearest_free_place
from flockwire_core.control.around.lateral_shift import lateral_shift
from flockwire_core.control.fence import Room
from flockwire_core.control.plane_polygon import Corner
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import ZERO, Vector

SPARE: Final = 0.05  # m beyond the kept distance: the safety filter must not slow down a drone on its detour
STANDING: Final = 0.03  # m/s, relative speed below which a place counts as at rest beside a body
MOVING: Final = 0.06  # m/s, from which on a place that was at rest beside obstacles moves: the speed has noise
SIDEWAYS, FASTEST_SIDEWAYS = 0.4, 0.6  # of the speed limit, and m/s, at which a place is shifted, at most
BETTER: Final = 0.2  # m by which the other side must be shorter
STAYS: Final = 0.5  # share of the last offset from which the next one is sought for a place at rest
AT_REST: Final = 0.1  # m/s, the speed of a person who stands, with the tracker's noise
LOOK_AHEAD = 0.6  # s for which another drone's motion is continued, to make room for it
SMOOTHING: Final = 0.1  # s
ARRIVED = (1e-3, 0.05)  # m, m/s: from here on a place is no longer bent
_CLOSED = 1e3  # m, of a side outside the room


def stands(body: Body) -> bool:
    """Return whether `body` is an obstacle, or another body at rest that is not a drone."""
    if body.kind is BodyKind.OBSTACLE:
        return True
    return body.kind is BodyKind.MOVER and hypot(body.velocity[0], body.velocity[1]) < AT_REST


@mypyc_attr(acyclic=True)
class DetourParameters(Record):
    """The distances that the safety filter keeps, the room, and the limits of speed, m/s, and acceleration, m/s^2.

    A mover is passed `early`, s: 1 / alpha of the safety filter, which else pushes a drone on before the mover.
    """

    __slots__ = ("separation", "room", "speed", "acceleration", "early")

    def __init__(self, separation: Separation, room: Room, speed: float, acceleration: float, early: float) -> None:
        self.separation: Final = separation
        self.room: Final = room
        self.speed: Final = speed
        self.acceleration: Final = acceleration
        self.early: Final = early

    @property
    def sideways(self) -> float:
        """The speed at which a place is shifted beside bodies, m/s."""
        return min(SIDEWAYS * self.speed, FASTEST_SIDEWAYS)

    def disc(self, body: Body, origin: Vector, spare: float) -> Disc:
        """Return what to stay outside of for `body`, which is relative to `origin`, with `spare` m to its distance."""
        x, y, _ = body.relative_position
        return (origin[0] + x, origin[1] + y, self.separation.from_axis(body) + spare)


class BentPlace:
    """The offset of one drone's bent place from its place, continuous with a continuous rate.

        o'' limited to b,   o' -> o*' + min(|o* - o| / 2T, sqrt(b |o* - o|)) (o* - o) / |o* - o|,   |o'| <= v_max - |v|

    o* is the offset for the bodies at present, v the place's velocity. Exactly zero without bodies.
    """

    def __init__(self, parameters: DetourParameters) -> None:
        self._parameters = parameters
        self._kept = parameters.separation.drone + SPARE  # m from another drone
        self._braking = min(0.5 * parameters.acceleration, 3.0)
        self._offset = self._rate = self._wanted = self._wanted_rate = (0.0, 0.0)
        self._sides = [0.0, 0.0]  # around obstacles, around movers; 0: none chosen
        self._rests = False  # whether the place is at rest beside obstacles

    @property
    def is_bent(self) -> bool:
        """Whether the place is bent at present."""
        return self._offset != (0.0, 0.0)

    def update(
        self, place: Vector, velocity: Vector, position: Vector, bodies: Sequence[Body], dt: float
    ) -> tuple[Vector, Vector]:
        """Return the offset, m, and its rate, m/s, of a `place` (m) that moves at `velocity` (m/s).

        `bodies` are relative to `position`, m; `dt` in s since the last call. Drones
        only count beside other bodies: then who must give way finds room.
        """
        wanted = self._shift((place[0], place[1]), velocity, position, bodies)
        if wanted == (0.0, 0.0) and self._offset == (0.0, 0.0):
            return ZERO, ZERO
        if dt > 0.0:
            self._move(wanted, max(self._parameters.speed - hypot(velocity[0], velocity[1]), 0.0), dt)
        return (*self._offset, 0.0), (*self._rate, 0.0)

    def _shift(self, place: Corner, velocity: Vector, position: Vector, bodies: Sequence[Body]) -> Corner:
        """Return the offset for the bodies at present, m."""
        own = self._parameters
        drones: list[Body] = []
        standing: list[Body] = []
        movers: list[Body] = []
        kind = BodyKind.DRONE
        for body in bodies:
            if body.kind is kind:
                drones.append(body)
            else:
                (standing if stands(body) else movers).append(body)
        outside = self._is_outside(place)
        if not standing and not movers and not outside:
            self._rests = False
            return (0.0, 0.0)
        obstacles = [own.disc(body, position, SPARE) for body in standing]
        x, y = place
        self._rests = bool(obstacles) and hypot(velocity[0], velocity[1]) < (MOVING if self._rests else STANDING)
        if self._rests or outside:
            x, y = self._nearest(place, obstacles)
        else:
            x, y = self._beside(place, (velocity[0], velocity[1]), obstacles, drones, position, 0)
        for body in movers:
            relative = (velocity[0] - body.velocity[0], velocity[1] - body.velocity[1])
            discs = [own.disc(body, position, SPARE)]
            x, y = self._beside((x, y), relative, discs, drones, position, 1, own.early)
        if standing or movers:
            x, y = self._make_room((x, y), velocity, drones, position)
        return (x - place[0], y - place[1])

    def _nearest(self, place: Corner, obstacles: Sequence[Disc]) -> Corner:
        """Return the nearest free place, near the last one where several are about as near."""
        room, (x, y), (wx, wy) = self._parameters.room, place, self._wanted
        nearest = nearest_free_place(place, obstacles, room) or place
        if nearest == place or self._wanted == (0.0, 0.0):
            return nearest
        kept = nearest_free_place((x + STAYS * wx, y + STAYS * wy), obstacles, room) or place
        return kept if dist(kept, place) < dist(nearest, place) + BETTER else nearest

    def _make_room(self, place: Corner, velocity: Vector, drones: Sequence[Body], position: Vector) -> Corner:
        """Return `place` away from `drones`, as they will be in LOOK_AHEAD s seen from the place."""
        x, y = place
        ox, oy = position[0] - LOOK_AHEAD * velocity[0], position[1] - LOOK_AHEAD * velocity[1]
        kept = self._kept
        for drone in drones:
            (rx, ry, _), (vx, vy, _) = drone.relative_position, drone.velocity
            dx, dy = x - ox - rx - LOOK_AHEAD * vx, y - oy - ry - LOOK_AHEAD * vy
            square = dx * dx + dy * dy
            if 0.0 < square < kept * kept:
                more = kept / sqrt(square) - 1.0
                x, y = x + dx * more, y + dy * more
        return (x, y)

    def _beside(
        self,
        place: Corner,
        velocity: Corner,
        discs: Sequence[Disc],
        drones: Sequence[Body],
        position: Vector,
        group: int,
        early: float = 0.0,
    ) -> Corner:
        """Return where `place`, which moves at `velocity` relative to the discs, passes them on the better side.

        That is the shorter one, but one that leads too near to `drones` counts as longer by twice how much.
        """
        speed = hypot(*velocity)
        if not discs or speed < STANDING:
            return place
        ux, uy = velocity[0] / speed, velocity[1] / speed
        slope = self._parameters.sideways / speed
        right, most_right = lateral_shift(place, (ux, uy), discs, -1.0, slope, early * speed)
        if most_right == 0.0:
            self._sides[group] = 0.0
            return place
        left, most_left = lateral_shift(place, (ux, uy), discs, 1.0, slope, early * speed)
        x, y = place
        to_right = self._cost((x + uy * most_right, y - ux * most_right), most_right, drones, position)
        to_left = self._cost((x - uy * most_left, y + ux * most_left), most_left, drones, position)
        kept = self._sides[group]
        to_right, to_left = to_right - BETTER * (kept == -1.0), to_left - BETTER * (kept == 1.0)
        if to_right <= to_left:
            self._sides[group] = -1.0
            return (x + uy * right, y - ux * right)
        self._sides[group] = 1.0
        return (x - uy * left, y + ux * left)

    def _cost(self, there: Corner, most: float, drones: Sequence[Body], position: Vector) -> float:
        """Return what it costs to pass at `there`, shifted by `most`, m: more among `drones` and outside the room."""
        x, y, crowded = there[0] - position[0], there[1] - position[1], 0.0
        kept = self._kept
        for drone in drones:
            crowded = max(crowded, kept - hypot(x - drone.relative_position[0], y - drone.relative_position[1]))
        return most + 2.0 * crowded + (_CLOSED if self._is_outside(there) else 0.0)

    def _is_outside(self, place: Corner) -> bool:
        """Return whether `place` is outside the room's walls."""
        room = self._parameters.room
        return room.outside((*place, room.low[2])) > 0.0

    def _move(self, wanted: Corner, top: float, dt: float) -> None:
        """Move the offset for `dt` s towards `wanted`, m, at most at `top` m/s."""
        before, self._wanted = self._wanted, wanted
        jump = ((wanted[0] - before[0]) / dt, (wanted[1] - before[1]) / dt)
        rate = jump if hypot(*jump) <= self._parameters.speed else (0.0, 0.0)  # else the side has changed
        (tx, ty), share = self._wanted_rate, min(dt / SMOOTHING, 1.0)
        tx, ty = self._wanted_rate = (tx + share * (rate[0] - tx), ty + share * (rate[1] - ty))
        (x, y), (vx, vy) = self._offset, self._rate
        dx, dy = wanted[0] - x, wanted[1] - y
        gap = hypot(dx, dy)
        if wanted == (0.0, 0.0) and gap < ARRIVED[0] and hypot(vx, vy) < ARRIVED[1]:
            self._offset = self._rate = self._wanted_rate = (0.0, 0.0)
            return
        pull = min(0.5 / SMOOTHING, sqrt(self._braking / gap)) if gap > 0.0 else 0.0
        wx, wy = _limited(tx + pull * dx, ty + pull * dy, top)
        ax, ay = _limited(wx - vx, wy - vy, self._braking * dt)
        self._offset, self._rate = (x + dt * (vx + ax), y + dt * (vy + ay)), (vx + ax, vy + ay)


def _limited(x: float, y: float, most: float) -> Corner:
    length = hypot(x, y)
    return (x, y) if length <= most else (x * most / length, y * most / length)
