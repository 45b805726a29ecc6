"""Processes that die in flight: which are started again, and which end the flight."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable

from flockwire.wire.plan import Plan

from flockwire_station.processes import Children

MOST_RESTARTS = 5  # of one process in one flight


class Restarts:
    """Looks after the children of one flight; `note` gets a line about each that is started again."""

    def __init__(self, plan: Plan, children: Children, note: Callable[[str], None]) -> None:
        self._plan, self._children, self._note = plan, children, note
        self._tasks: list[asyncio.Task[None]] = []
        self._counts: Counter[str] = Counter()  # of restarts, by identity

    def step(self) -> str:
        """Start what died again, where the process table has it so; returns a line about another one that died.

        What refused to run would do so again.
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
        """Wait for what is under way."""
        await asyncio.gather(*self._tasks)
