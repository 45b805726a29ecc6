"""Processes that die in flight: which are restarted, and which end the flight."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable

from flockwire.wire.plan import Plan

from flockwire_station.processes import Children

MOST_RESTARTS = 5  # of one process in one flight


class Restarts:
    """Restarts the children of one flight; `note` gets a line about each restart."""

    def __init__(self, plan: Plan, children: Children, note: Callable[[str], None]) -> None:
        self._plan, self._children, self._note = plan, children, note
        self._tasks: list[asyncio.Task[None]] = []
        self._counts: Counter[str] = Counter()  # of restarts, by identity

    def step(self) -> str:
        """Restart dead processes if the process table allows it; returns a line about another dead one.

        A process that refused its configuration is not restarted.
        """
        for identity in self._children.ended():
            again = self._plan.rows[identity].restarts and not self._children.refused(identity)
            if again and self._counts[identity] < MOST_RESTARTS:
                self._counts[identity] += 1
                self._note(f"{self._children.how(identity)}; restarted")
                self._children.kill(identity)  # its exit is then expected
                self._tasks.append(asyncio.create_task(self._children.restart(identity)))
        return self._children.died()

    async def end(self) -> None:
        """Wait for pending work."""
        await asyncio.gather(*self._tasks)
