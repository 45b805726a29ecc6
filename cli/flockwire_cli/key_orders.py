"""Orders by keys beside the live table: for the flight that is conducted here, or by another host."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from flockwire import clock
from flockwire.flight.director import STOP_FOR, Director, Stage
from flockwire.wire.messages import Stop
from flockwire.wire.plan import Plan

from flockwire_cli.giving import obey
from flockwire_cli.operator import Operator
from flockwire_cli.order import Order

ELSEWHERE = "formation: this host does not conduct the flight; `flockwire start` takes off and flies it"


class KeyOrders:
    """Gives orders as `operator`: through `director`, None where another host conducts; `note` prints a line."""

    def __init__(self, plan: Plan, operator: Operator, director: Director | None, note: Callable[[str], None]) -> None:
        self._plan, self._operator, self._director, self._note = plan, operator, director, note
        self._stop_until = 0  # an emergency stop is repeated until then, Unix ns
        self._answers: set[asyncio.Task[None]] = set()

    def give(self, verb: str) -> None:
        """Give an order at once, or print why not: "hold", "land", "formation" or "stop"."""
        now, director = clock.now(), self._director
        if verb == "stop":
            self._stop_until = now + STOP_FOR
            self.repeat(now)
            if director is not None:
                director.stop(now)
        elif director is not None:
            order = {"hold": director.hold, "land": director.land, "formation": director.resume}[verb](now)
            self._operator.order(order)
            if order is None and director.stage is not Stage.OVER:
                self._note(f"{verb}: nothing ordered while {director.stage}")
        elif verb == "formation":
            self._note(ELSEWHERE)
        else:
            task = asyncio.create_task(self._answered(verb))
            self._answers.add(task)
            task.add_done_callback(self._answers.discard)

    def repeat(self, now: int) -> None:
        """Give an emergency stop again for a while after it was ordered; `now` in Unix ns."""
        if now < self._stop_until:
            self._operator.order(Stop(now, self._plan.swarm.frame, "the operator's order"))

    def end(self) -> None:
        """Repeat nothing any more: the session is about to close."""
        for task in self._answers:
            task.cancel()

    async def _answered(self, verb: str) -> None:
        """Repeat an order until all have confirmed it, and print who did."""
        answer = await obey(self._operator, self._plan, Order(verb))
        missing = f"; not confirmed by {', '.join(answer.missing)}" if answer.missing else ""
        self._note(f"{verb}: confirmed by {', '.join(answer.confirmed) or 'nobody'}{missing}")
