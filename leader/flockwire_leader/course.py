"""The course of a flying leader: its trajectory, which waits while the leader is held back, and detours.

    u_0 = p x_d'(s) + K (x_d(s) − x_0),     ds/dt = p = max(p_error, p_place)        (ours)

p_error falls from 1 to 0 as the leader falls behind the goal x_d(s). p_place is 1 where the goal is too near to a body:
there the goal continues, and waits on the other side. With the safety filter the planner leads the leader to its goal;
without it (law "paper") there is neither, and the trajectory does not wait.

With lag, dead time or compensated disturbances, the filtered leader's stopping point y is led instead, which obeys its
commands at once:

    u_0 = p x_d'(s + p A) + K (x_d(s + p A) − y),     A = lag + dead time        (ours)
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf
from typing import Final

from flockwire_core.control.around.planner import Planner
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, scale, subtract
from flockwire_core.parameters import guard_parameters
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.trajectories import trajectory_of

CHANGE = 0.25  # s, T: the shortest time of the pace from 1 to 0
LONGEST_STEP: Final = 0.1  # s: after a longer pause the trajectory has waited


def free_error(speed: float, delay: float, braking: float) -> float:
    """Return the error, m, up to which a follower of a goal at `speed` m/s counts as not held back.

        e_free = e_0 + 2 v (tau + v / b)        (ours)

    It is the lead of a goal that reverses at once: `delay` is tau in s, lag, dead time and the delay of a command;
    `braking` b in m/s^2.
    """
    return 0.1 + 2.0 * speed * (delay + speed / braking)  # m, e_0: noise, and the rest of a transient


def falling(value: float, begin: float, width: float) -> float:
    """Return 1 up to `begin`, 0 from `begin` + `width` (> 0) on, a straight line between."""
    return min(max(1.0 - (value - begin) / width, 0.0), 1.0)


class TrajectoryTime:
    """The own time s of a trajectory, at most t; all times in s.

    ds/dt = p in [0, 1],   |dp/dt| <= 1 / T,   s = t exactly as long as p = 1        (ours)

    `pace` is p, `waited` is t − s.
    """

    def __init__(self, longest_step: float = LONGEST_STEP) -> None:
        self.pace, self.waited, self._last = 1.0, 0.0, 0.0
        self._longest_step = longest_step

    def restart(self, t: float) -> None:
        """Set s = t."""
        self.pace, self.waited, self._last = 1.0, 0.0, t

    def resume(self, t: float) -> None:
        """Continue at `t` from the last s: the trajectory has waited until now."""
        self.waited += t - self._last
        self.pace, self._last = 1.0, t

    @property
    def last(self) -> float:
        """The trajectory's time s at the last step."""
        return self.at(self._last)

    def at(self, t: float) -> float:
        """Return s at `t` if it does not wait until then."""
        return t - self.waited

    def advance(self, t: float, pace: float) -> float:
        """Return s at `t`, in which p has come nearer to `pace`."""
        step = max(t - self._last, 0.0)
        passed, self._last = min(step, self._longest_step), t
        change = passed / CHANGE
        self.pace = min(max(pace, self.pace - change), self.pace + change)
        self.waited += step - self.pace * passed
        return t - self.waited


SLACK = 0.3  # m beyond the free error at which the trajectory stops
CLEAR = 0.2  # m beyond the safety distance from which on a goal may wait
CATCH_UP = 0.3  # m/s, largest correction, unless the trajectory itself is faster


class Course:
    """The leader's trajectory, from where it is when it begins; `time` is the trajectory's own, with its waits."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        airframe, leader = swarm.airframe(number), swarm.leading[number]
        self._trajectory, self._gain = trajectory_of(leader), leader.tracking_gain
        filtered, ahead = swarm.control.filtered, airframe.lag + airframe.dead_time
        self._planner = Planner(guard_parameters(swarm, number), self._gain, number) if filtered else None
        self.time = TrajectoryTime(LONGEST_STEP if filtered else inf)
        self._ahead = ahead if filtered else 0.0
        # control periods, from a command to the pose that shows it
        self._delay = ahead + 3.0 / swarm.control.rate_hz
        self._braking, self._separation = swarm.limits.acceleration, swarm.avoidance.kept
        self._origin = ZERO  # start of the trajectory, m
        self._fastest = 0.0  # m/s, the highest rate so far

    def restart(self, position: Vector, t: float) -> None:
        """Fly the trajectory from mission time `t`, s, shifted so that it starts at `position`, m."""
        self.time.restart(t)
        self._place(position, t)

    def resume(self, position: Vector, t: float) -> None:
        """Continue the interrupted trajectory at mission time `t`, shifted so that it starts at `position`."""
        self.time.resume(t)
        self._place(position, self.time.at(t))

    def velocity(self, motion: Motion, bodies: Sequence[Body], t: float, now: float) -> Vector:
        """Return the desired velocity, m/s, of the stopping point at mission time `t`; `now` has any origin (s)."""
        s = self.time.at(t)
        pace = self._wanted_pace(motion, s, bodies) if self._planner is not None else 1.0
        s = self.time.advance(t, pace)
        led, rate = self._seen_from(motion.stopping, s + self.time.pace * self._ahead)
        speed, rate = norm(rate), scale(rate, self.time.pace)
        if self._planner is None:
            return add(rate, scale(led, self._gain))
        correction = self._planner.correction(scale(led, -1.0), motion, rate, bodies, now)
        if any(body.kind is BodyKind.MOVER for body in bodies):  # whom it must leave the way, as fast as it can
            return add(rate, correction)
        return add(rate, limit(correction, max(speed, CATCH_UP)))

    def goal(self) -> Vector:
        """Return where the leader was to be at its last step, m."""
        return self._goal(self.time.last)

    def _goal(self, s: float) -> Vector:
        return add(self._origin, self._trajectory.position(s))

    def _place(self, position: Vector, s: float) -> None:
        self._origin = subtract(position, self._trajectory.position(s))

    def _seen_from(self, position: Vector, s: float) -> tuple[Vector, Vector]:
        """Return the error x_d(s) − `position`, m, and the rate x_d'(s), m/s."""
        return subtract(self._goal(s), position), self._trajectory.rate(s)

    def _wanted_pace(self, motion: Motion, s: float, bodies: Sequence[Body]) -> float:
        error, rate = self._seen_from(motion.position, s)
        self._fastest = max(norm(rate), self._fastest)
        # a wind holds back the position farther than the stopping point
        behind = min(norm(error), norm(self._seen_from(motion.stopping, s + self.time.pace * self._ahead)[0]))
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
