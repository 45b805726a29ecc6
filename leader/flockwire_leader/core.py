"""The leader without clock, input or output: it flies uav0, on its trajectory or as steered, where it flies."""

from __future__ import annotations

from flockwire.control.graph import LEADER
from flockwire.control.vector import ZERO, Vector
from flockwire.flight.cores import Start
from flockwire.flight.phases import Phase
from flockwire.flight.pilot import Pilot
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.keys import Key
from flockwire.wire.messages import Command, Message, Mission
from flockwire.wire.status import Report

from flockwire_leader.course import Course
from flockwire_leader.steering import Steering
from flockwire_leader.tracked import TrackedLeader
from flockwire_leader.virtual import VirtualLeader

SILENCE = 0.0  # s: the leader has no in-neighbours that it could miss


class FlyingLeader:
    """Flies drone 0 along the trajectory, or as a person steers it; started at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, now: int) -> None:
        self._pilot = Pilot(swarm, LEADER, now)
        self.triggers = frozenset({self._pilot.pose_key})
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._course = Course(swarm)
        self._steering = Steering(swarm) if swarm.leader.kind == "teleoperated" else None
        self._flown: Mission | None = None  # the order that the course is of

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        if isinstance(message, Mission):
            self._pilot.flight.order(message)
            return
        if self._steering is not None and isinstance(message, Command):
            self._steering.take(message)
            return
        take = self._pilot.take.get(key)
        if take is not None:
            take(message)

    def due(self, key: Key) -> bool:
        """Return True: each own pose calls for a step."""
        return True

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        pilot = self._pilot
        was = pilot.flight.phase
        phase = pilot.observe(now, SILENCE, (), "", _no_neighbours)
        wanted = self._wanted(was, now) if phase is Phase.FORMATION else ZERO
        return pilot.command(wanted, now)

    def retire(self, now: int) -> None:
        """Hold, then land: the process is to end."""
        self._pilot.retire(now)

    def may_end(self, now: int) -> bool:
        """Return whether the drone is down."""
        return self._pilot.may_end(now)

    def report(self, now: int) -> Report:
        """Return how the leader is."""
        report = self._pilot.report(now)
        if self._steering is not None and not report.detail and report.phase == Phase.FORMATION:
            report = report._replace(detail=self._steering.described(now))
        return report

    def _wanted(self, was: Phase, now: int) -> Vector:
        """Return the velocity along the course, which restarts with a new order and goes on after a hold."""
        pilot, course = self._pilot, self._course
        mission, motion = pilot.flight.mission, pilot.motion
        if mission is None or motion is None:
            return ZERO
        if self._steering is not None:
            if was is not Phase.FORMATION:
                self._steering.rest()
            return self._steering.velocity(motion.position, now, pilot.dt)
        if self._flown is None or mission.start != self._flown.start:  # an order again does not restart the course
            self._flown = mission
            course.restart(motion.position, (now - mission.start) / BILLION)
        elif was is not Phase.FORMATION:
            course.resume(motion.position, (now - mission.start) / BILLION)
        t = (pilot.stamp - mission.start) / BILLION
        return course.velocity(motion.position, pilot.bodies, t, (now - pilot.born) / BILLION)


def _no_neighbours() -> list[Vector]:
    return []


def make_core(start: Start) -> FlyingLeader | TrackedLeader | VirtualLeader:
    """Return the core of the leader that the swarm has."""
    swarm = start.plan.swarm
    if swarm.leader.kind == "tracked":
        return TrackedLeader(swarm)
    return VirtualLeader(swarm, start.now) if swarm.leader.kind == "virtual" else FlyingLeader(swarm, start.now)
