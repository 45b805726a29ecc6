"""The safety filter around every law: it limits a drone's commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

from flockwire_core.control.barrier import Approach, keep_clear, sight_speed, speed_and_acceleration
from flockwire_core.control.fence import Room
from flockwire_core.control.safety_filter import HalfSpace, nearest_velocity
from flockwire_core.control.tracker import BodyTracks, VelocityTracker
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.record import Frozen
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, distance, limit, norm, scale, subtract

BODY_TIME_CONSTANT = 0.05  # s, of the trackers of nearby bodies
UNSEEN: Final = 0.004  # m of distance that others may not see, as they expect another stopping way; else both count
STOPPING_DISTANCE_FACTOR: Final = 1.25  # stopping-distance factor: the airframe is known to about 20 %
TOUCHING: Final = 0.2  # m/s, added to the vertical speed: the highest speed in take-off and landing below the floor
_TOUCHES: Final = 1e-9  # m/s from a constraint within which a velocity is held by it
_MOVER: Final = 0  # the ranks of half-spaces: what cannot all be satisfied is given up from below
_FIXED: Final = 1  # walls, obstacles
_HALT: Final = 2  # as far as standing still satisfies what other drones ask, or the spaces of lost bodies
_FLIGHT: Final = 3  # what they ask beyond that
BARRIER_PERIODS: Final = 4.5  # besides lag and dead time, of the delay of others' reactions (docs/theory.md, section 5)


@dataclass(frozen=True, slots=True)
class GuardParameters(Frozen):
    """The parameters of one drone's safety filter."""

    separation: Separation
    room: Room
    floor: float  # m
    speed: float  # m/s, at most
    vertical_speed: float  # m/s, out of an obstacle that has grown around it, and as it lands
    acceleration: float  # m/s^2, of commands
    barrier_rate: float  # 1/s, alpha at most
    slowness: float  # s, lag and dead time of the airframe
    period: float  # s, between two commands
    sight: float  # m, within which bodies are sensed; inf without sensing
    unheard: float  # s without a command after which the driver stops the drone

    @property
    def rate(self) -> float:
        """The barrier's rate alpha, 1/s, that suits the airframe."""
        return min(self.barrier_rate, 1.0 / max(self.slowness + BARRIER_PERIODS * self.period, self.unheard))

    @property
    def fastest(self) -> float:
        """The highest speed, m/s, of the filter: two drones that meet still stop in time."""
        return min(self.speed, self.sight_speed(0.0))

    @property
    def delay(self) -> float:
        """The time, s, until a drone brakes for another one: tau of `sight_speed`."""
        return STOPPING_DISTANCE_FACTOR * self.slowness + 3.0 * self.period

    @property
    def silence(self) -> float:
        """The time, s, until a drone stands that saw another one when the last command reached it."""
        return self.unheard + self.slowness + 3.0 * self.period

    def sight_speed(self, age: float) -> float:
        """Return the speed, m/s, at which two drones still stop in time if their data is `age` s old."""
        apart, delay, silence = self.separation.drone, self.delay + age, self.silence + age
        return sight_speed(self.sight, apart, delay, self.acceleration, silence)


class Guard:
    """The safety filter of one drone, and its trackers of nearby drones."""

    def __init__(self, parameters: GuardParameters) -> None:
        self._parameters = parameters
        self._rate, self._fastest = parameters.rate, parameters.fastest
        self._tracks = BodyTracks(BODY_TIME_CONSTANT)
        self._own: VelocityTracker | None = None  # as late as the others are: both of two see the same velocities
        self._epoch = 0  # Unix ns, time 0 of the tracks
        kept = parameters.separation
        drone, obstacle = kept.drone, kept.obstacle
        descent = parameters.vertical_speed
        # separation, m, rank and speed of recovery, m/s, by BodyKind
        self._asked = ((drone, _FIXED, inf), (obstacle, _FIXED, descent), (obstacle, _MOVER, inf))
        self.is_cornered = False  # no velocity within the limits satisfies what a mover asks
        self.cornered = 0  # how often it came to that
        self.is_held = self.is_held_by_fixed = False  # whether a constraint, one of what is fixed, holds the velocity

    def velocity(
        self,
        wanted: Vector,
        motion: Motion,
        bodies: Sequence[Body],
        stamp: int,
        now: int,
        last: Vector,
        dt: float,
        speed: float,
        grounding: bool,
    ) -> Vector:
        """Return the nearest velocity to `wanted` that satisfies all constraints.

        `bodies` were seen at `stamp`, relative to `motion.position`, the result of `tracked`; `last` is the command
        before this one, `dt` s ago; `speed` the current limit; `grounding` during take-off and landing: no floor.
        """
        own = self._parameters
        speed, change = min(speed, self._fastest), own.acceleration * dt
        floor, recovery, lowest = own.floor, inf, -inf
        if grounding:
            above = max(motion.stopping[2] - own.floor, 0.0)
            speed = min(speed, own.vertical_speed + TOUCHING + self._rate * above)
            floor, recovery = own.room.low[2], own.vertical_speed  # a landing flies back no faster than it descends
            lowest = min(-own.vertical_speed - TOUCHING, last[2] + change)
        seen = limit(wanted, own.sight_speed(max(now - stamp, 0) / SECOND))
        approach = Approach(last, speed, self._rate, own.acceleration)
        spaces, ranks = self._bodies(motion, bodies, (now - stamp) / SECOND, approach)
        spaces += own.room.half_spaces(motion.position, motion.stopping, floor, approach, recovery)
        if grounding:  # the ground may be nearer than the pose has it
            spaces.append((0.0, 0.0, 1.0, lowest))
        ranks += [_FIXED] * (len(spaces) - len(ranks))
        centre, radius, plane = speed_and_acceleration(last, speed, change)
        limits = [plane] if plane is not None else []
        movers = [spaces[k] for k, rank in enumerate(ranks) if rank == _MOVER]
        v, violation = nearest_velocity(seen, spaces + limits, radius, centre)
        if violation > 0.0:
            v = _compromise(seen, spaces, ranks, movers + limits, approach, speed, change)
        x, y, z = v = limit((v[0], v[1], max(v[2], lowest)), approach.speed)
        was = self.is_cornered
        held = [ranks[k] for k, (nx, ny, nz, b) in enumerate(spaces) if nx * x + ny * y + nz * z < b + _TOUCHES]
        self.is_held, self.is_held_by_fixed = bool(held), _FIXED in held
        self.is_cornered = violation > 0.0 and any(nx * x + ny * y + nz * z < b - _TOUCHES for nx, ny, nz, b in movers)
        self.cornered += self.is_cornered and not was
        return v

    def tracked(self, motion: Motion, bodies: Sequence[Body], stamp: int) -> list[Body]:
        """Return `bodies`, seen at `stamp` relative to `motion.position`, with the tracked velocities of drones."""
        self._epoch = self._epoch or stamp
        at = (stamp - self._epoch) / SECOND
        if self._own is None:
            self._own = VelocityTracker(BODY_TIME_CONSTANT, motion.position, at)
        self._own.update(motion.position, at)
        positions = [add(motion.position, body.relative_position) for body in bodies]
        velocities = self._tracks.update(positions, at)
        return [
            Body(body.kind, body.relative_position, body.radius, velocities[k]) if body.kind is BodyKind.DRONE else body
            for k, body in enumerate(bodies)
        ]

    def _bodies(
        self, motion: Motion, bodies: Sequence[Body], age: float, approach: Approach
    ) -> tuple[list[HalfSpace], list[int]]:
        """Return what bodies seen `age` s ago ask, and its ranks; drones and what may be elsewhere ask in two."""
        horizon = STOPPING_DISTANCE_FACTOR * self._parameters.slowness + age
        tracked = self._own.velocity if self._own is not None else ZERO
        own, seen = self._stopping(motion, scale(tracked, horizon))
        alone, both, apart = [own], [own, seen], distance(own, seen)
        spaces: list[HalfSpace] = []
        ranks: list[int] = []
        for place, body in enumerate(bodies):
            x, y, z = body.relative_position
            vx, vy, vz = body.velocity
            velocity = ZERO if self._tracks.is_new(place) else tracked  # nor has the body seen for the first time one
            drone = body.kind is BodyKind.DRONE
            reach, rank, recovery = self._asked[body.kind]
            upright = False
            if not drone:
                reach += body.radius
                upright = z == 0.0
            if upright:  # beside such a cylinder no height matters, nor its rate
                vz = 0.0
            yields = drone or (rank == _FIXED and body.velocity != ZERO)  # or its space grows
            unseen = drone and apart * apart > 2.0 * UNSEEN * norm(body.relative_position)
            for sx, sy, sz in both if unseen else alone:
                rise = 0.0 if upright else sz
                stopping = (sx - x - horizon * vx, sy - y - horizon * vy, rise - z - horizon * vz)
                space = keep_clear((-x, -y, -z), stopping, velocity, (vx, vy, vz), drone, reach, approach, recovery)
                if space is None:
                    continue
                if yields:
                    rank = _HALT
                    if space[3] > 0.0:
                        spaces.append((space[0], space[1], space[2], 0.0))
                        ranks.append(_HALT)
                        rank = _FLIGHT
                spaces.append(space)
                ranks.append(rank)
        return spaces, ranks

    def _stopping(self, motion: Motion, seen: Vector) -> tuple[Vector, Vector]:
        """Return the way to the stopping point, and that way as the other drones see it: `seen` where it takes time."""
        own = subtract(motion.stopping, motion.position)
        return (scale(own, STOPPING_DISTANCE_FACTOR), seen) if self._parameters.slowness else (own, own)


def _compromise(
    wanted: Vector,
    spaces: list[HalfSpace],
    ranks: list[int],
    first: list[HalfSpace],
    approach: Approach,
    speed: float,
    change: float,
) -> Vector:
    """Return the velocity where not all can be satisfied: the step, `change` m/s at most, straight towards a goal.

    The goal satisfies all (or violates least, by `ranks`). It is the one nearest to the last command, but no faster
    than b/alpha, up to which the acceleration does not limit the approach, or than what asks for the most. So a fast
    drone brakes straight, by which walls, obstacles and other drones lose the least. If the goal is near enough, the
    velocity is the nearest to `wanted` that satisfies as much. What comes `first` is satisfied in any case.
    """
    last, slow = approach.last, min(approach.braking / approach.rate, speed)
    most = min(max([slow, *(b for _, _, _, b in spaces)]), speed)
    goal, _ = nearest_velocity(limit(last, slow), spaces, most, ZERO, ranks)
    step = subtract(goal, last)
    if norm(step) > change:
        return nearest_velocity(add(last, limit(step, change)), first, change, last)[0]
    return nearest_velocity(wanted, spaces, change, last, ranks)[0]
