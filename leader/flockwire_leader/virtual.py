"""A virtual leader's core: a point on the trajectory."""

from __future__ import annotations

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.pilot.leadership import LeaderSign
from flockwire_core.pilot.moving_point import MovingPoint
from flockwire_core.process.cores import Ground
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

from flockwire_leader.lead_messages import LeadMessages, WatchedMotion


class VirtualLeader(Ground):
    """A point that moves along the trajectory after a start order, and rests after any other."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        super().__init__()
        self.prompt = frozenset({MISSION})
        self._frame, self.period = swarm.frame, 1.0 / swarm.control.rate_hz
        self._lead, self._sign, self._motion = (
            LeadMessages(swarm, number, now),
            LeaderSign(swarm, number),
            WatchedMotion(),
        )
        self._pose_key, leader = Key("pose", uav(number)), swarm.leading[number]
        self._point = MovingPoint(leader.trajectory.build(), leader.start)

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        if isinstance(message, Mission):
            self._point.order(message, now)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish the point's position at `now`."""
        position = self._point.advance(now)
        led = self._lead.messages(self._point.orders.mission, self._motion.update(position, now), now)
        return [(self._pose_key, Pose(now, self._frame, position)), *self._sign.messages(True, now), *led]

    def report(self, now: int) -> Report:
        """Return the leader's status."""
        point = self._point
        phase = Phase.FORMATION if point.moves(now) else Phase.READY
        orders = point.orders
        return Report(
            phase, mission=orders.mission, position=point.position, unnumbered=orders.unnumbered,
            order_age=orders.age(now),
        )  # fmt: skip
