"""Swarm time for a process: it asks for it, and corrects its clock."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

from flockwire import clock
from flockwire.domain.time import SECOND
from flockwire.process.timekeeping import Timekeeping, is_known, timekeeping
from flockwire.runtime.session import Session
from flockwire.runtime.subscriptions import Prompt, Wakeup
from flockwire.wire.plan import Plan

POLL = 0.02  # s between two looks whether swarm time is known
LONG = 1.0  # s


class SwarmClock:
    """Corrects this process's clock, in the running loop; on the gateway's host there is nothing to do.

    `lock` is held while the clock is corrected, and by whoever runs a core while that does anything.
    """

    def __init__(self, plan: Plan, identity: str, session: Session) -> None:
        self.lock = threading.Lock()
        self.timekeeping: Timekeeping = timekeeping(plan, identity, clock.correct)
        self.prompts: list[Prompt] = []
        self._session, self._subscribed = session, False

    def step(self) -> None:
        """Ask again when it is time: to be called ten times a second or more."""
        if not self._subscribed:
            self._subscribed = True
            self._subscribe()
        if outgoing := self.timekeeping.step(clock.now()):
            self._session.publish(outgoing)

    async def settled(self, ended: asyncio.Event, seconds: float, idle: Callable[[], None] = lambda: None) -> None:
        """Wait until swarm time is known here, or the process is to end, or `seconds` have passed.

        `idle` is called again and again when that takes longer than LONG.
        """
        self.step()
        began = clock.monotonic()
        while not (self.known() or ended.is_set() or clock.monotonic() - began >= seconds * SECOND):
            if clock.monotonic() - began > LONG * SECOND:
                idle()
            await asyncio.sleep(POLL)
            self.step()

    def known(self) -> bool:
        """Return whether swarm time is known here."""
        return is_known(self.timekeeping, clock.now())

    def _subscribe(self) -> None:
        if self.timekeeping.keys:
            wakeup = Wakeup(self._arrived, self.lock)
            self.prompts = [self._session.prompt(key, wakeup) for key in self.timekeeping.keys]

    def _arrived(self, prompt: Prompt) -> None:
        now = clock.now()
        message = prompt.message(now)
        if message is not None:
            self._session.publish(self.timekeeping.receive(prompt.inbox.key, message, now))
