"""The core of the process in ROS 2: the swarm's messages in, publications and orders out.

Each order has a service, of which those that the file does not name are refused.
"""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Callable

from flockwire_core.domain.order import Answer, Order
from flockwire_core.domain.pose import Pose
from flockwire_core.ground.operator import OperatorCore
from flockwire_core.process.cores import Ground, Start
from flockwire_core.swarm.model import DEFAULT_FORMATION, Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Counts, Report, counted

from flockwire_operator.ros.mirror import Mirror
from flockwire_operator.ros.steering import Steering
from flockwire_operator.ros.topics import Names

REASON = "a ROS service"
MOST_WAITING = 16  # requests of one order that wait for its answer

Respond = Callable[[bool, str], None]


def services(swarm: Swarm) -> dict[str, Order]:
    """Return the order of each service, by its absolute name."""
    names = Names(swarm)
    found = {names.absolute(verb): Order(verb, reason=REASON) for verb in ("start", "hold", "land", "stop")}
    for name in swarm.formation_names:
        last = name or (DEFAULT_FORMATION if DEFAULT_FORMATION not in swarm.formations else "")
        if last:
            found[names.absolute(f"formation/{last}")] = Order("formation", name)
    return found


class Services:
    """Gives the orders that arrive as requests, by `operator`; `counts` counts what was refused."""

    def __init__(self, swarm: Swarm, operator: OperatorCore) -> None:
        self.counts: Counter[str] = Counter()
        self.orders = services(swarm)
        self._allowed = frozenset(swarm.ros.orders if swarm.ros is not None else ())
        self._operator = operator
        self._waiting: dict[Order, list[Respond]] = {}

    def request(self, name: str, now: int, respond: Respond) -> None:
        """Give the order of the service `name` at `now` (Unix ns); `respond` gets whether all confirmed it, and a text.

        A request of an order that waits for its answer gets the same answer.
        """
        order = self.orders[name]
        if order.verb not in self._allowed:
            self.counts["ROS orders refused"] += 1
            respond(False, f"refused: ros.orders of the swarm file does not have {order.verb!r}")
            return
        waiting = self._waiting.get(order)
        if waiting is None:
            self._waiting[order] = [respond]
            self._operator.ask(order, now, answered=lambda answer: self._answered(order, answer))
        elif len(waiting) < MOST_WAITING:
            waiting.append(respond)
        else:
            self.counts["ROS orders refused"] += 1
            respond(False, f"refused: {MOST_WAITING} requests wait for the answer to this order")

    def _answered(self, order: Order, answer: Answer) -> None:
        failure = answer.failure
        confirmed = ", ".join(answer.confirmed)
        text = failure or "; ".join(filter(None, (f"confirmed by {confirmed}", answer.note)))
        for respond in self._waiting.pop(order, []):
            respond(not failure, text)


PERIOD = 0.01  # s: messages of this time are published together


class RosCore(Ground):
    """Shows the swarm of `plan` in ROS 2 by `mirror`, None while there is no ROS side, and gives its orders.

    `new_giver` returns a unique number of a giver of orders.
    """

    period = PERIOD

    def __init__(self, plan: Plan, new_giver: Callable[[], int] = lambda: secrets.randbits(31)) -> None:
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
    return RosCore(start.plan)
