"""The safety filter round every law: what a drone may command, whatever it wants."""

from __future__ import annotations

from collections.abc import Sequence

from flockwire.control.airframe_state import Motion
from flockwire.control.barrier import keep_clear, sight_speed, speed_and_acceleration
from flockwire.control.body_tracks import BodyTracks
from flockwire.control.safety_filter import HalfSpace, nearest_velocity
from flockwire.control.vector import Vector, add, limit, norm, scale, subtract
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.messages import Body, BodyKind

BODY_TIME_CONSTANT = 0.05  # s, of the trackers of nearby bodies
STOPPING_DISTANCE_FACTOR = 1.25  # a margin: the airframe is known to about 20 %


class Guard:
    """The safety filter of drone `number` of `swarm`."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        frame, limits, safe = swarm.airframe(number), swarm.limits, swarm.avoidance
        period = 1.0 / swarm.control.rate_hz
        self._slowness = frame.lag + frame.dead_time
        self._limits = limits
        self._drone_distance = safe.drone_distance_kept
        self._obstacle_distance = safe.obstacle_distance_kept
        self.rate = min(safe.barrier_rate, BARRIER_PHASE / (self._slowness + 3.0 * period))
        self._braking = limits.acceleration
        self._delay = STOPPING_DISTANCE_FACTOR * self._slowness + 3.0 * period
        self._sight = safe.sensing_radius if safe.sensing == "nearby" else float("inf")
        self.speed = min(limits.speed, self._sight_speed(0.0))
        self._tracks = BodyTracks(BODY_TIME_CONSTANT)
        self._epoch = 0  # Unix ns that the tracks' time counts from
        self._room = limits.fence.room()

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
        """Return the nearest velocity to `wanted` that keeps clear of everything.

        `bodies` were seen at `stamp`, relative to `motion.position`; `last` is the command before this one, `dt` s ago;
        `speed` the limit of the moment; `grounding` when it comes from the ground or goes there: no floor.
        """
        speed = min(speed, self.speed)
        wanted = limit(wanted, self._sight_speed(max(now - stamp, 0) / BILLION))
        spaces = self._bodies(motion, bodies, stamp, now, speed)
        floor = self._room.low[2] if grounding else self._limits.floor
        spaces += self._room.half_spaces(motion.position, motion.stopping, floor, self.rate, self._braking, speed)
        centre, radius, sliver = speed_and_acceleration(last, speed, self._limits.acceleration * dt)
        if sliver is not None:
            spaces.append(sliver)
        # Where not all can be kept, the sliver is one of what gives way; the limit of speed does not.
        return limit(nearest_velocity(wanted, spaces, radius, centre)[0], max(speed, norm(last)))

    def _sight_speed(self, age: float) -> float:
        """Return the speed, m/s, at which two drones still stop in time when what is seen is `age` s old."""
        return sight_speed(self._sight, self._drone_distance, self._delay + age, self._braking)

    def _bodies(self, motion: Motion, bodies: Sequence[Body], stamp: int, now: int, speed: float) -> list[HalfSpace]:
        self._epoch = self._epoch or stamp
        positions = [add(motion.position, body.relative_position) for body in bodies]
        velocities = self._tracks.update(positions, (stamp - self._epoch) / BILLION)
        own = scale(subtract(motion.stopping, motion.position), STOPPING_DISTANCE_FACTOR if self._slowness else 1.0)
        horizon = STOPPING_DISTANCE_FACTOR * self._slowness + (now - stamp) / BILLION
        found = []
        for body, velocity in zip(bodies, velocities, strict=True):
            x, y, z = body.relative_position
            drone = body.kind is BodyKind.DRONE
            vx, vy, vz = velocity if drone else body.velocity
            rise = own[2] if drone or z else 0.0  # along an upright cylinder nothing changes
            separation = (-x, -y, -z)
            stopping = (own[0] - x - horizon * vx, own[1] - y - horizon * vy, rise - z - horizon * vz)
            distance = self._drone_distance if drone else self._obstacle_distance + body.radius
            space = keep_clear(separation, stopping, (vx, vy, vz), drone, distance, self.rate, self._braking, speed)
            if space is not None:
                found.append(space)
        return found


BARRIER_PHASE = 0.7
"""The barrier's rate times lag and dead time: what the others do shows that late (docs/theory.md)."""
