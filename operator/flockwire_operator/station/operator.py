"""The shell around the operator's core in real time: polls the session, steps the core, publishes, plans changes.

A change of formation is planned in a thread, so that the loop that sends a stop never waits for it. The first plan
imports numpy and scipy: then the loop is late once, by 0.05 s (0.16 s on a machine with ten times its load), later by
the interpreter's switch interval.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from flockwire_core import clock
from flockwire_core.domain.order import Mission, Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.delivery import Answered, ChangeDelivery
from flockwire_core.ground.director import GRACE, POLL_PERIOD
from flockwire_core.ground.operator import OperatorCore
from flockwire_core.objects import load_object
from flockwire_core.process.cores import Core
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.swarm_clock import SwarmClock
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.keys import TIME_REPLY

PLAN = "flockwire_core.ground.formation_planning:plan_in_time"  # needs the extra `station`: numpy and scipy

Result = TypeVar("Result")


class Operator:
    """Runs the core of an operator, or of a process with the same rights, on its `session`.

    `outer` is the process's core if it does more than give orders; it has `core` in it.
    """

    def __init__(self, session: Session, core: OperatorCore | None = None, outer: Core | None = None) -> None:
        plan, identity = session.plan, session.identity
        self.core = core or OperatorCore(plan, partial(secrets.randbits, 31))
        self.statuses, self.telemetry = self.core.statuses, self.core.telemetry
        self.clock = SwarmClock(plan, identity, session)
        self.clock.timekeeping.follow(self.core.correct)
        self.inputs = [session.buffered(key) for key in plan.subscribes[identity] if key.kind != TIME_REPLY]
        self._session = session
        self._outer: Core | OperatorCore = outer or self.core
        self._planning: dict[ChangeDelivery, asyncio.Task[None]] = {}
        self.core.knows_time = self.clock.known()

    def poll(self) -> int:
        """Receive the messages that came since the last call; returns the current time, Unix ns."""
        self.clock.step()
        now = clock.now()
        for source in self.inputs:
            for message in source.messages(now):
                self._outer.receive(source.inbox.key, message, now)
        self.core.knows_time = self.clock.known()
        return now

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
        """Step the core, publish its messages, and plan the changes that wait for it."""
        self._session.publish(self._outer.step(clock.now()))
        waiting = self.core.to_plan
        for made in [made for made in self._planning if made not in waiting]:
            self._planning.pop(made).cancel()
        for made in waiting:
            if made not in self._planning:
                self._planning[made] = asyncio.create_task(_answer(self._session.plan.swarm, made))

    async def run(self, turn: Callable[[int], Result | None], period: float | None = None) -> Result:
        """Poll, step and publish until `turn`, called with the time (Unix ns) before each step, returns something.

        `period` is in s (default: POLL_PERIOD); it is 0.02 s while an order is being given.
        """
        usual, due = POLL_PERIOD if period is None else period, clock.monotonic()
        while True:
            result = turn(self.poll())
            if result is not None:
                return result
            self.publish()
            due = max(due + nanoseconds(0.02 if self.core.is_ordering else usual), clock.monotonic())
            await asyncio.sleep((due - clock.monotonic()) / SECOND)

    async def watch(self, seconds: float, seen: Callable[[], bool] = bool) -> None:
        """Receive messages for `seconds`, or until `seen` returns True."""
        deadline = clock.monotonic() + nanoseconds(seconds)
        await self.run(lambda _: seen() or clock.monotonic() >= deadline or None)


async def _answer(swarm: Swarm, made: ChangeDelivery) -> None:
    try:
        mission = await asyncio.to_thread(plan_order, swarm, made)
    except ValueError as error:  # ChangeRefusedError: it cannot be flown
        made.planned(None, str(error))
    except Exception as error:  # the order waits for an answer
        made.planned(None, f"the change could not be planned: {type(error).__name__}: {error}")
    else:
        made.planned(mission)


def plan_order(swarm: Swarm, made: ChangeDelivery) -> Mission:
    """Return the order for the change that `made` has to plan. Raises ChangeRefusedError."""
    order: Mission = load_object(PLAN)(swarm, made, clock.now)
    return order
