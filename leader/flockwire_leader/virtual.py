"""The virtual leader without clock, input or output: a point on the trajectory, which nothing holds back."""

from __future__ import annotations

from flockwire.control.graph import LEADER
from flockwire.control.vector import Vector, add, subtract
from flockwire.flight.phases import FlightPhases, Phase
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import Key
from flockwire.wire.messages import Message, Mission, Pose
from flockwire.wire.status import Report


class VirtualLeader:
    """A point that moves along the trajectory while the order is to start, and stands still otherwise."""

    def __init__(self, swarm: Swarm, now: int) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._swarm = swarm
        self._trajectory = swarm.leader.trajectory.build()
        self._flight = FlightPhases(now)
        self._position: Vector = swarm.leader.start
        self._origin: Vector = swarm.leader.start  # where the trajectory begins

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        if isinstance(message, Mission):
            self._flight.order(message)
            t = self._flight.mission_time(now)
            if t is not None and self._flight.mission is message:
                self._origin = subtract(self._position, self._trajectory.position(t))

    def due(self, key: Key) -> bool:
        """Return False: a point moves at its own rate."""
        return False

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish where the point is at `now`."""
        t = self._flight.mission_time(now)
        if t is not None:
            self._position = add(self._origin, self._trajectory.position(t))
        return [(Key("pose", uav(LEADER)), Pose(now, self._swarm.frame, self._position))]

    def retire(self, now: int) -> None:
        """Do nothing: a point flies nothing."""

    def may_end(self, now: int) -> bool:
        """Return True."""
        return True

    def report(self, now: int) -> Report:
        """Return how the leader is."""
        moving = (self._flight.mission_time(now) or 0.0) > 0.0
        return Report(Phase.FORMATION if moving else Phase.READY, mission=self._flight.mission)
