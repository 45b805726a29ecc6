"""The core of the process in ROS 2: the swarm's messages in, publications and orders out."""

from __future__ import annotations

import secrets
from collections.abc import Callable

from flockwire_core.domain.pose import Pose
from flockwire_core.ground.operator import OperatorCore
from flockwire_core.process.cores import Ground, Start
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Counts, Report, counted

from flockwire_operator.ros.mirror import Mirror
from flockwire_operator.ros.services import Respond, Services
from flockwire_operator.ros.steering import Steering

PERIOD = 0.01  # s: messages of this time are published together


class RosCore(Ground):
    """Shows the swarm of `plan` in ROS 2 by `mirror`, None while there is no ROS side, and gives its orders.

    `new_giver` returns a unique number of a giver of orders.
    """

    period = PERIOD

    def __init__(self, plan: Plan, new_giver: Callable[[], int]) -> None:
        super().__init__()
        self.operator = OperatorCore(plan, new_giver)
        self.services = Services(plan.swarm, self.operator)
        leader = next((i for i, one in plan.swarm.leading.items() if one.follows_ros), None)
        self.steering = Steering(plan.swarm, leader) if leader is not None else None
        self.mirror: Mirror | None = None
        self.trouble = "waits for the ROS side"  # why there is none; empty when there is
        self.advice = ""  # why the leader's topic is silent; empty when it is not
        self.dropped: Callable[[], Counts] = tuple  # what the ROS side sent and was dropped
        self._leader = Key("pose", uav(leader)) if leader is not None else None

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message of the swarm."""
        self.operator.receive(key, message, now)
        if self.steering is not None and key == self._leader and isinstance(message, Pose):
            self.steering.position(message.position)
        if self.mirror is not None:
            self.mirror.receive(key, message)

    def request(self, name: str, now: int, respond: Respond) -> None:
        """Receive a request of the service `name`."""
        self.services.request(name, now, respond)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Return the orders to give, and the command of the leader."""
        messages = list(self.operator.step(now))
        if self.steering is not None:
            messages += self.steering.command(now)
        return messages

    def report(self, now: int) -> Report:
        """Return whether the ROS side is there, and what was refused."""
        steering = self.steering.counts if self.steering is not None else {}
        counts = (*counted(*self.services.counts.items(), *steering.items()), *self.dropped())
        phase = Phase.WAITING if self.trouble else Phase.SERVING
        return Report(phase, self.trouble or self.advice, counts=counts)


def make_core(start: Start) -> RosCore:
    """Return the core, without a ROS side."""
    return RosCore(start.plan, lambda: secrets.randbits(31))
