"""The shell around the operator's core in real time: polls the session, steps the core, publishes, plans changes."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from flockwire_core import clock
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.director import GRACE, POLL_PERIOD
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.operator import Answered, OperatorCore
from flockwire_core.ground.order import Order
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.swarm_clock import SwarmClock
from flockwire_core.wire.keys import TIME_REPLY
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR

from flockwire_operator.station.planning import Planner

GIVING_PERIOD = 0.02  # s between two steps while an order is being given

Result = TypeVar("Result")


class Operator:
    """Runs the core of `identity`, the operator or one with the same rights, on `session`."""

    def __init__(self, plan: Plan, session: Session, identity: str = OPERATOR.kind) -> None:
        self.core = OperatorCore(plan, partial(secrets.randbits, 31))
        self.statuses, self.telemetry = self.core.statuses, self.core.telemetry
        self._plan, self._session = plan, session
        self._clock = SwarmClock(plan, identity, session)
        self._clock.timekeeping.follow(self.core.correct)
        self._inputs = [session.buffered(key) for key in plan.subscribes[identity] if key.kind != TIME_REPLY]
        self._planner = Planner()
        self.core.knows_time = self._clock.known()

    def poll(self) -> int:
        """Receive the newest messages; returns the current time, Unix ns."""
        self._clock.step()
        now, core = clock.now(), self.core
        for source in self._inputs:
            message = source.message(now)
            if message is not None:
                core.receive(source.inbox.key, message, now)
        core.knows_time = self._clock.known()
        return now

    def fleet(self) -> Fleet:
        """Return the current state of the fleet, without silent drones that are left out."""
        now = self.poll()
        return self.core.fleet(now).present()

    def conduct(self, duration: float, without: tuple[int, ...] = (), grace: int = GRACE) -> None:
        """Conduct a flight that was requested at the start of this process; the arguments are those of Director."""
        now = clock.now()
        self.core.conduct(now, duration, Order("start", without=without), grace, now - nanoseconds(clock.uptime()))

    def ask(self, order: Order, ago: float = 0.0, answered: Answered = lambda _: None) -> None:
        """Give an order that was requested `ago` s ago; one that ends others is sent before this returns."""
        now = clock.now()
        self.core.ask(order, now, now - nanoseconds(ago), answered)
        self.publish()

    def order(self, verb: str, note: Callable[[str], None] = lambda _: None) -> None:
        """Give the order of a key, or of a script, at once (OperatorCore.order)."""
        self.core.order(verb, clock.now(), note)
        self.publish()

    def publish(self) -> None:
        """Step the core, and publish its messages."""
        self._session.publish(self.core.step(clock.now()))
        self._planner.plan(self._plan.swarm, self.core.to_plan)

    async def run(self, turn: Callable[[int], Result | None], period: float | None = None) -> Result:
        """Poll, step and publish until `turn`, called with the time (Unix ns) before each step, returns something.

        `period` is in s (default: POLL_PERIOD); it is GIVING_PERIOD while an order is being given.
        """
        usual, due = POLL_PERIOD if period is None else period, clock.monotonic()
        while True:
            result = turn(self.poll())
            if result is not None:
                return result
            self.publish()
            due = max(due + nanoseconds(GIVING_PERIOD if self.core.is_ordering else usual), clock.monotonic())
            await asyncio.sleep((due - clock.monotonic()) / SECOND)

    async def watch(self, seconds: float, seen: Callable[[], bool] = bool) -> None:
        """Receive messages for `seconds`, or until `seen` returns True."""
        deadline = clock.monotonic() + nanoseconds(seconds)
        await self.run(lambda _: seen() or clock.monotonic() >= deadline or None)
