"""The cores of leaders without an airframe: a body that a person carries, or a point on the trajectory."""

from __future__ import annotations

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.vector import Vector
from flockwire_core.pilot.moving_point import MovingPoint
from flockwire_core.pilot.orders import Orders
from flockwire_core.pilot.phases import age
from flockwire_core.process.cores import Ground
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.trajectories import trajectory_of
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

from flockwire_leader.lead_messages import LeadMessages, WatchedMotion


class GroundedLeader(Ground):
    """The common part: leader `number` of `swarm`, its `orders`, and what it sends while it leads."""

    def __init__(self, swarm: Swarm, number: int, now: int, orders: Orders) -> None:
        self.period, self.prompt = 1.0 / swarm.control.rate_hz, frozenset({MISSION})
        self._pose_key, self._orders = Key("pose", uav(number)), orders
        self._lead, self._motion = LeadMessages(swarm, number, now), WatchedMotion()

    def _leading(self, position: Vector, stamp: int, now: int) -> list[tuple[Key, Message]]:
        """Return the sign and the law's message of a leader that was at `position` (m) at `stamp` (Unix ns)."""
        return self._lead.messages(self._orders.mission, self._motion.update(position, stamp), now)

    def _report(self, phase: Phase, position: Vector | None, now: int, detail: str = "", age: float = -1.0) -> Report:
        orders = self._orders
        return Report(
            phase, detail, pose_age=age, mission=orders.mission, position=position, unnumbered=orders.unnumbered,
            order_age=orders.age(now),
        )  # fmt: skip


class TrackedLeader(GroundedLeader):
    """Reports whether the tracker sees the body; the gateway publishes its pose to the followers."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        super().__init__(swarm, number, now, Orders())
        self._body, self._limit = swarm.body(number), swarm.limits.staleness.pose_zero  # s
        self._pose: Pose | None = None

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        match message:
            case Pose() if key == self._pose_key:
                self._pose = message
            case Mission():
                self._orders.take(message, now)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish that it leads, while the tracker sees the body."""
        pose = self._pose
        if pose is None or age(pose.stamp, now) > self._limit:
            return []
        return self._leading(pose.position, pose.stamp, now)

    def report(self, now: int) -> Report:
        """Return the leader's status."""
        pose, unseen = self._pose, f"the tracker has not seen its body {self._body!r}"
        if pose is None:
            return self._report(Phase.POSE_LOST, None, now, f"{unseen} yet")
        silence = age(pose.stamp, now)
        if silence <= self._limit:
            return self._report(Phase.TRACKED, pose.position, now, age=silence)
        return self._report(Phase.POSE_LOST, pose.position, now, f"{unseen} for {silence:.1f} s", silence)


class VirtualLeader(GroundedLeader):
    """A point that moves along the trajectory after a start order, and rests after any other."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        leader = swarm.leading[number]
        self._frame, self._point = swarm.frame, MovingPoint(trajectory_of(leader), leader.start)
        super().__init__(swarm, number, now, self._point.orders)

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        if isinstance(message, Mission):
            self._point.order(message, now)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish the point's position at `now`."""
        position = self._point.advance(now)
        return [(self._pose_key, Pose(now, self._frame, position)), *self._leading(position, now, now)]

    def report(self, now: int) -> Report:
        """Return the leader's status."""
        phase = Phase.FORMATION if self._point.moves(now) else Phase.READY
        return self._report(phase, self._point.position, now)
