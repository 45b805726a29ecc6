"""A tracked leader's core: it watches a body that a person carries, and commands nothing."""

from __future__ import annotations

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.leadership import LeaderSign
from flockwire_core.pilot.orders import Orders
from flockwire_core.pilot.phases import NEVER, age
from flockwire_core.process.cores import Ground
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

from flockwire_leader.lead_messages import LeadMessages, WatchedMotion


class TrackedLeader(Ground):
    """Reports whether the tracker sees the body; the gateway publishes its pose to the followers."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        super().__init__()
        self.period, self._body = 1.0 / swarm.control.rate_hz, swarm.body(number)
        self._limit = swarm.limits.staleness.pose_zero  # s
        self._pose_key = Key("pose", uav(number))
        self._pose: Pose | None = None
        self._lead, self._sign, self._motion = (
            LeadMessages(swarm, number, now),
            LeaderSign(swarm, number),
            WatchedMotion(),
        )
        self._orders = Orders()
        self.prompt = frozenset({MISSION})

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
        led = self._lead.messages(self._orders.mission, self._motion.update(pose.position, pose.stamp), now)
        return [*self._sign.messages(True, now), *led]

    def report(self, now: int) -> Report:
        """Return the leader's status."""
        pose = self._pose
        silence = age(pose.stamp, now) if pose is not None else NEVER
        phase = Phase.TRACKED if silence <= self._limit else Phase.POSE_LOST
        return Report(
            phase,
            self._trouble(silence, now),
            pose_age=(now - pose.stamp) / SECOND if pose is not None else -1.0,
            mission=self._orders.mission,
            position=pose.position if pose is not None else None,
            unnumbered=self._orders.unnumbered,
            order_age=self._orders.age(now),
        )

    def _trouble(self, silence: float, now: int) -> str:
        if silence == NEVER:
            return f"the tracker has not seen its body {self._body!r} yet"
        return f"the tracker has not seen its body {self._body!r} for {silence:.1f} s" if silence > self._limit else ""
