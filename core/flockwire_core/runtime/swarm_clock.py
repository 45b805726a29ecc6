"""Requests swarm time for a process, and corrects its clock."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.process.timekeeping import Timekeeping, is_known, timekeeping
from flockwire_core.runtime.samples import Prompt, Wakeup
from flockwire_core.runtime.session import Session
from flockwire_core.wire.plan import Plan

LONG = 1.0  # s


class SwarmClock:
    """Corrects this process's clock, in the running loop; idle on the gateway's host.

    `lock` is held while the clock is corrected, and by the runner of a core during its calls.
    """

    def __init__(self, plan: Plan, identity: str, session: Session) -> None:
        self.lock = threading.Lock()
        self.timekeeping: Timekeeping = timekeeping(plan, identity, clock.correct)
        self.prompts: list[Prompt] = []
        self._session = session

    def step(self) -> None:
        """Send a due request; call it at least ten times a second."""
        if self.timekeeping.keys and not self.prompts:
            wakeup = Wakeup(self._arrived, self.lock)
            self.prompts = [self._session.prompt(key, wakeup) for key in self.timekeeping.keys]
        if outgoing := self.timekeeping.step(clock.now()):
            self._session.publish(outgoing)

    async def wait_for_time(self, ended: asyncio.Event, seconds: float, idle: Callable[[], None]) -> None:
        """Wait until swarm time is known, the process must end, or `seconds` have passed.

        `idle` is called repeatedly if that takes longer than LONG.
        """
        self.step()
        began = clock.monotonic()
        while not (self.known() or ended.is_set() or clock.monotonic() - began >= seconds * SECOND):
            if clock.monotonic() - began > LONG * SECOND:
                idle()
            await asyncio.sleep(0.02)  # s between two checks for swarm time
            self.step()

    def known(self) -> bool:
        """Return whether swarm time is known."""
        return is_known(self.timekeeping, clock.now())

    def _arrived(self, prompt: Prompt) -> None:
        now = clock.now()
        message = prompt.message(now)
        if message is not None:
            self._session.publish(self.timekeeping.receive(prompt.inbox.key, message, now))
