"""The operator's core: receives statuses, conducts a flight, gives and repeats orders, and stops.

It is the same in real time (operator/station/operator.py) and in virtual time (lab/operator.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.order import ENDING, Answer, Mission, Order, Stop
from flockwire_core.ground.delivery import (
    Answered,
    ChangeDelivery,
    DownDelivery,
    OrderDelivery,
    StartDelivery,
    StopDelivery,
)  # fmt: skip
from flockwire_core.ground.director import GRACE, Director, Stage
from flockwire_core.ground.fleet import Fleet
from flockwire_core.pilot.orders import rank
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, PROPOSAL, STOP, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

ELSEWHERE = "resume: this host does not conduct the flight; `flockwire start` takes off and flies it"
START = Order("start")
ENDED = Answer(refusal="another order was given meanwhile")

DELIVERIES: Mapping[str, type[OrderDelivery]] = {
    "start": StartDelivery, "formation": ChangeDelivery, "hold": DownDelivery, "land": DownDelivery,
    "stop": StopDelivery,
}  # fmt: skip


class OperatorCore:
    """Gives orders to the swarm of `plan`; `new_giver` returns a unique number of a giver of orders.

    `director` conducts the newest flight, None before the first. `knows_time` is False while swarm time is not known.
    """

    def __init__(self, plan: Plan, new_giver: Callable[[], int]) -> None:
        self.statuses: dict[str, Status] = {}
        self.telemetry: dict[int, Telemetry] = {}
        self.director: Director | None = None
        self.knows_time = True
        self._plan, self._new_giver = plan, new_giver
        self._drones = {uav(drone): drone for drone in plan.pilots}
        self._pending: list[OrderDelivery] = []  # stops first

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a status or telemetry; no process publishes another's status."""
        if isinstance(message, Status) and message.identity == key.owner:
            self.statuses[key.owner] = message
        elif isinstance(message, Telemetry):
            self.telemetry[self._drones[key.owner]] = message

    def correct(self, by: int) -> None:
        """Record that `now` jumps ahead by `by` ns (back if negative): this time has not passed."""
        for one in self._pending:
            one.correct(by)

    def fleet(self, now: int) -> Fleet:
        """Return the state of all pilots at `now` (Unix ns)."""
        return Fleet(self._plan.pilots, self.statuses, self.telemetry, now)

    def conduct(
        self, now: int, duration: float = 0.0, order: Order = START, grace: int = GRACE, asked: int | None = None
    ) -> Director:
        """Conduct a flight from `now` (Unix ns) on; return its Director."""
        asked = now if asked is None else asked
        self.director = Director(self._plan, order, self._new_giver(), asked, self.fleet(now), duration, grace)
        return self.director

    def order(self, verb: str, now: int, note: Callable[[str], None] = lambda _: None) -> None:
        """Order "hold", "land", "resume" or "stop" for the flight conducted here or, without one, for another host's.

        `note` gets a line if nothing is ordered, and the confirmations of an order to another host's flight.
        """
        if verb == "stop":
            self.ask(Order(verb), now)
        elif self.director is not None and self.director.stage is not Stage.OVER:
            director = self.director
            given = {"hold": director.hold, "land": director.land, "resume": director.resume}[verb](now)
            if given is None and director.stage is not Stage.OVER:
                note(f"{verb}: nothing ordered while {director.stage}")
        elif verb == "resume":
            note(ELSEWHERE)
        else:
            self.ask(Order(verb), now, answered=lambda answer: note(f"{verb}: {_line(answer)}"))

    def abort(self, reason: str, now: int) -> None:
        """End the flight conducted here because of `reason`, unless it has failed already."""
        if self.director is not None and not self.director.failure:
            self.director.abort(reason, now)

    def ask(self, order: Order, now: int, asked: int | None = None, answered: Answered = lambda _: None) -> None:
        """Give `order` from the next step on; it was requested at `asked` (Unix ns, default: `now`).

        A stop, a landing and a hold are published at that step, and end a pending start or change of formation. Other
        orders wait for swarm time, LOOK_TIME at most.
        """
        if order.verb in ENDING:
            ended = [one for one in self._pending if one.order.verb not in ENDING]
            self._pending = [one for one in self._pending if one.order.verb in ENDING]
            for one in ended:
                one.answered(ENDED)
        made = DELIVERIES[order.verb]
        new = made(self._plan, order, self._new_giver(), now if asked is None else asked, now, answered)
        if order.verb != "stop":
            self._pending.append(new)
            return
        self._pending.insert(0, new)
        if self.director is not None:
            self.director.stop(now)

    @property
    def is_ordering(self) -> bool:
        """Whether an order is pending."""
        return bool(self._pending)

    @property
    def to_plan(self) -> list[ChangeDelivery]:
        """The pending orders that wait for a planned change of formation."""
        return [one for one in self._pending if isinstance(one, ChangeDelivery) and one.to_plan is not None]

    def step(self, now: int) -> Iterator[tuple[Key, Message]]:
        """Yield the messages to publish at `now`, a stop first."""
        fleet = self.fleet(now)
        for one in tuple(self._pending):
            yield from self._give(one, fleet)
        director = self.director
        if director is not None and director.stage is not Stage.OVER:
            due = director.step(fleet)
            if due is not None:
                yield _key(due), due

    def _give(self, one: OrderDelivery, fleet: Fleet) -> Iterator[tuple[Key, Message]]:
        """Continue an order; it is answered once and then ends, except for a stop, which is repeated for STOP_TIME."""
        if not self.knows_time and one.may_wait(fleet.now):
            return
        message = one.step(fleet) if one.answer is None or one.order.verb == "stop" else None
        if message is not None:
            yield _key(message), message
        if one.answer is None:
            return
        if message is None:
            self._pending = [other for other in self._pending if other is not one]
        if not one.is_answered:
            one.is_answered = True
            one.answered(one.answer)


def _key(message: Mission | Stop) -> Key:
    """Return the key of an order: what takes up is proposed to the gateway."""
    if isinstance(message, Stop):
        return STOP
    return MISSION if rank(message) else PROPOSAL


def _line(answer: Answer) -> str:
    """Return a line with the confirmations of an order."""
    missing = f"; not confirmed by {', '.join(answer.missing)}" if answer.missing else ""
    reason = f" ({answer.refusal})" if answer.refusal else ""
    return f"confirmed by {', '.join(answer.confirmed) or 'nobody'}{missing}{reason}"
