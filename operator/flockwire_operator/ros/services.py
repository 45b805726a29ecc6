"""The orders of the ROS side: one service for each, of which those that the file does not name are refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from flockwire_core.ground.operator import OperatorCore
from flockwire_core.ground.order import Answer, Order
from flockwire_core.swarm.model import DEFAULT_FORMATION, Swarm

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
