"""A flying leader's core: it flies its drone on its trajectory or as steered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, subtract
from flockwire_core.objects import load_object
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.neighbourhood import LEADING_PHASES
from flockwire_core.pilot.phases import age
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.pilot.wanted import keep_place
from flockwire_core.process.cores import Core, Start
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, STEERING, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

from flockwire_leader.course import Course
from flockwire_leader.lead_messages import FlownMotion, LeadMessages

GROUNDED: Mapping[str, str] = {  # the leaders without an airframe of their own, by kind: "module:class"
    "tracked": "flockwire_leader.grounded:TrackedLeader",
    "virtual": "flockwire_leader.grounded:VirtualLeader",
}


class FlyingLeader:
    """Flies leader `number` along its trajectory, or as a person steers it; started at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        pilot, airframe = pilot_parameters(swarm, number), swarm.airframe(number)
        self._pilot = Pilot(pilot, now)
        self.retire, self.may_end = self._pilot.retire, self._pilot.may_end
        self.triggers = frozenset({self._pilot.pose_key})
        self.prompt = frozenset({MISSION})
        self.period = pilot.guard.period
        self._course = Course(swarm, number)
        ahead = airframe.lag + airframe.dead_time  # s
        self._leads_stopping = pilot.filtered and (ahead > 0.0 or pilot.disturbance > 0.0)
        self._teleoperation = Teleoperation(swarm, number) if swarm.leading[number].steered else None
        if self._teleoperation is not None:
            self._pilot.handlers[Key(STEERING, uav(number))] = self._teleoperation.take
        self._lead, self._motion = LeadMessages(swarm, number, now), FlownMotion(airframe.lag)
        self._flown: Mission | None = None  # the order of the course

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        if isinstance(message, Mission):
            self._pilot.flight.order(message, now)
        elif (take := self._pilot.handlers.get(key)) is not None:
            take(message)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        pilot = self._pilot
        was = pilot.flight.phase
        phase = pilot.observe(now, 0.0, (), "", list)  # s: a leader has no in-neighbours
        wanted = self._wanted(was, now) if phase is Phase.FORMATION else ZERO
        messages, mission = pilot.command(wanted, now), pilot.flight.mission if phase is Phase.FORMATION else None
        flown = self._motion.update(pilot.motion, pilot.sent, pilot.dt)
        return messages + self._lead.messages(mission, flown, now, phase in LEADING_PHASES)

    def report(self, now: int) -> Report:
        """Return the leader's status."""
        report = self._pilot.report(now, place=self._course.goal() if self._teleoperation is None else None)
        if self._teleoperation is not None and not report.line and report.phase == Phase.FORMATION:
            report = report._replace(detail=self._teleoperation.described(now))
        failure = self._lead.failure
        return report if failure is None else report._replace(reasons=(*report.reasons, failure))

    def _wanted(self, was: Phase, now: int) -> Vector:
        """Return the velocity along the course, which restarts with a new order and continues after a hold."""
        pilot, course = self._pilot, self._course
        mission, motion = pilot.flight.mission, pilot.motion
        if mission is None or motion is None:
            return ZERO
        if self._teleoperation is not None:
            if was is not Phase.FORMATION:
                self._teleoperation.rest()
            return self._teleoperation.velocity(motion.position, now, pilot.dt)
        if self._flown is None or mission.start != self._flown.start:  # a repeated order does not restart the course
            self._flown = mission
            course.restart(motion.position, (now - mission.start) / SECOND)
        elif was is not Phase.FORMATION:
            course.resume(motion.position, (now - mission.start) / SECOND)
        t = (pilot.stamp - mission.start) / SECOND
        if not self._leads_stopping:
            motion = Motion(motion.position, motion.velocity, motion.position)
        return course.velocity(motion, pilot.bodies, t, (now - pilot.born) / SECOND)


class Teleoperation:
    """Follows the leader's newest steering command within its speed and acceleration.

    A command older than limits.staleness.steering_stop is none: the leader stops at once.
    """

    def __init__(self, swarm: Swarm, number: int) -> None:
        leader = swarm.leading[number]
        self._speed, self._acceleration = leader.speed, leader.acceleration  # m/s, m/s^2
        self._vertical_speed, self._stale = swarm.limits.vertical_speed, swarm.limits.staleness.steering_stop  # m/s, s
        self._newest: Steer | None = None
        self._velocity: Vector = ZERO
        self._place: Vector | None = None  # held while it is not steered

    def take(self, command: Steer) -> None:
        """Receive the newest command: a velocity in m/s, world frame."""
        self._newest = command

    def rest(self) -> None:
        """Reset to rest: the leader is not steered."""
        self._velocity, self._place = ZERO, None

    def velocity(self, position: Vector, now: int, dt: float) -> Vector:
        """Return the desired velocity, m/s, at `position` (m) and `now` (Unix ns), `dt` s after the last one."""
        newest = self._newest
        if newest is None or age(newest.stamp, now) > self._stale:
            self._velocity = ZERO
        else:
            wanted = limit(newest.velocity, self._speed)
            change = limit(subtract(wanted, self._velocity), self._acceleration * dt)
            self._velocity = add(self._velocity, change)
        if norm(self._velocity) > 1e-6:  # m/s below which the leader holds its position
            self._place = None
            return self._velocity
        self._place = self._place or position
        return keep_place(position, self._place, self._vertical_speed)

    def described(self, now: int) -> str:
        """Return the problem of the link, empty while commands arrive."""
        if self._newest is None:
            return "no steering command"
        silence = (now - self._newest.stamp) / SECOND
        return f"no steering command for {silence:.1f} s" if silence > self._stale else ""


def make_core(start: Start) -> Core:
    """Return the core of one leader, by its kind."""
    swarm, number = start.plan.swarm, start.drone
    grounded = GROUNDED.get(swarm.leading[number].kind)
    if grounded is None:
        return FlyingLeader(swarm, number, start.now)
    return cast("Core", load_object(grounded)(swarm, number, start.now))
