"""The course of a flying leader: its trajectory, which waits while the leader is held back, and detours.

    u_0 = p x_d'(s) + K (x_d(s) − x_0),     ds/dt = p = max(p_error, p_place)        (ours)

p_error falls from 1 to 0 as the leader falls behind the goal x_d(s). p_place is 1 where the goal is too near to a body:
there the goal continues, and waits on the other side. With the safety filter the correction is rotated around
obstacles; without it (law "paper") there is no guard and no sidestep, and the trajectory does not wait.

With lag, dead time or compensated disturbances, the filtered leader's stopping point y is led instead, which obeys its
commands at once:

    u_0 = p x_d'(s + p A) + K (x_d(s + p A) − y),     A = lag + dead time        (ours)
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf

from flockwire_core.control.around.bent_place import BentPlace
from flockwire_core.control.around.sidestep import Sidestep
from flockwire_core.control.trajectory_time import LONGEST_STEP, TrajectoryTime, falling, free_error
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, scale, subtract
from flockwire_core.parameters import detour_parameters, guard_parameters, sidestep_parameters
from flockwire_core.swarm.model import Swarm

SLACK = 0.3  # m beyond the free error at which the trajectory stops
CLEAR = 0.2  # m beyond the safety distance from which on a goal may wait
CATCH_UP = 0.5  # m/s, largest correction, unless the trajectory itself is faster


class Course:
    """The leader's trajectory, from where it is when it begins; `time` is the trajectory's own, with its waits."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        airframe, leader = swarm.airframe(number), swarm.leading[number]
        self._trajectory, self._gain, self._filtered = (
            leader.trajectory.build(),
            leader.tracking_gain,
            swarm.control.filtered,
        )
        self.time = TrajectoryTime(LONGEST_STEP if self._filtered else inf)
        self._ahead = airframe.lag + airframe.dead_time
        # control periods, from a command to the pose that shows it
        self._delay = self._ahead + 3.0 / swarm.control.rate_hz
        self._braking, self._separation = swarm.limits.acceleration, swarm.avoidance.kept
        # s without progress: half around an obstacle takes long at that speed
        self._sidestep = Sidestep(sidestep_parameters(swarm), 10.0)
        self._detour = detour_parameters(guard_parameters(swarm, number))
        self._straighten()
        self._origin = ZERO  # start of the trajectory, m
        self._passed = 0.0  # m along the trajectory
        self._s = 0.0  # the trajectory's own time
        self._fastest = 0.0  # m/s, the highest rate so far

    def restart(self, position: Vector, t: float) -> None:
        """Fly the trajectory from mission time `t`, s, shifted so that it starts at `position`, m."""
        self.time.restart(t)
        self._straighten()
        self._place(position, t)

    def resume(self, position: Vector, t: float) -> None:
        """Continue the interrupted trajectory at mission time `t`, shifted so that it starts at `position`."""
        self.time.resume(t)
        self._place(position, self.time.at(t))

    def velocity(
        self, position: Vector, bodies: Sequence[Body], t: float, now: float, stopping: Vector | None = None
    ) -> Vector:
        """Return the desired velocity, m/s, at `position` (m) and mission time `t`; `now` has any origin (s).

        `stopping` is the stopping point, m, that is led; None: the position itself.
        """
        s = self.time.at(t)
        error, rate = self._seen_from(position, s)
        pace = self._wanted_pace(error, stopping, s, norm(rate), bodies) if self._filtered else 1.0
        s = self.time.advance(t, pace)
        if self.time.pace < 1.0:
            error, rate = self._seen_from(position, s)
        speed, rate = norm(rate), scale(rate, self.time.pace)
        led = error
        if stopping is not None:
            led, rate = self._seen_from(stopping, s + self.time.pace * self._ahead)
            rate = scale(rate, self.time.pace)
        if self._filtered:
            offset, sideways = self._around(error, rate, position, bodies, now)
            if offset != ZERO:
                error, led, rate = add(error, offset), add(led, offset), add(rate, sideways)
        correction = scale(led, self._gain)
        self._passed += speed * (s - self._s)
        self._s = s
        if self._filtered:
            to_go = norm(error) - self._passed  # a moving goal is not a lack of progress
            correction = limit(correction, max(speed, CATCH_UP))
            correction = self._sidestep.turned(correction, bodies, to_go, now, rate)
        return add(rate, correction)

    def _straighten(self) -> None:
        self._bent, self._bent_at = BentPlace(self._detour), inf  # s, the time of its last step

    def _around(
        self, error: Vector, rate: Vector, position: Vector, bodies: Sequence[Body], now: float
    ) -> tuple[Vector, Vector]:
        """Return the offset of the goal that lets movers pass, m, and its rate, m/s."""
        dt, self._bent_at = min(max(now - self._bent_at, 0.0), LONGEST_STEP), now  # it did not lead during a hold
        if not (self._bent.is_bent or any(body.kind is BodyKind.MOVER for body in bodies)):
            return ZERO, ZERO
        movers = [body for body in bodies if body.kind is not BodyKind.OBSTACLE]
        return self._bent.update(add(position, error), rate, position, movers, dt)

    def _place(self, position: Vector, s: float) -> None:
        self._origin, self._s = subtract(position, self._trajectory.position(s)), s

    def _seen_from(self, position: Vector, s: float) -> tuple[Vector, Vector]:
        """Return the error x_d(s) − `position`, m, and the rate x_d'(s), m/s."""
        goal = add(self._origin, self._trajectory.position(s))
        return subtract(goal, position), self._trajectory.rate(s)

    def _wanted_pace(
        self, error: Vector, stopping: Vector | None, s: float, speed: float, bodies: Sequence[Body]
    ) -> float:
        behind, self._fastest = norm(error), max(speed, self._fastest)
        if stopping is not None:  # a wind holds back the position farther than the stopping point
            behind = min(behind, norm(self._seen_from(stopping, s + self.time.pace * self._ahead)[0]))
        free = free_error(self._fastest, self._delay, self._braking)
        if behind <= free:
            return 1.0
        gap = min((self._gap(error, body) for body in bodies), default=inf)
        return max(falling(behind, free, SLACK), falling(gap, 0.0, CLEAR))

    def _gap(self, goal: Vector, body: Body) -> float:
        """Return the distance of `goal` beyond a body's safety distance, m; both relative to the leader."""
        x, y, z = body.relative_position
        drone = body.kind is BodyKind.DRONE
        rise = z - goal[2] if drone or z else 0.0  # the axis of an upright cylinder does not matter
        distance = hypot(x - goal[0], y - goal[1], rise) - body.radius
        return distance - (self._separation.drone if drone else self._separation.obstacle)
