"""An event queue instead of a clock: time, in integer ns, jumps from event to event."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any

Action = Callable[[Any], None]


class Scheduler:
    """Calls actions at their times; those of one time in the order of scheduling."""

    def __init__(self, now: int) -> None:
        self.now = now  # true time, Unix ns
        self._queue: list[tuple[int, int, Action, Any]] = []
        self._count = 0
        self._stopped = False

    def at(self, time: int, action: Action, argument: object = None) -> None:
        """Call `action(argument)` at `time` (Unix ns), which has not passed."""
        self._count += 1
        heappush(self._queue, (time, self._count, action, argument))

    def run(self, end: int) -> None:
        """Run events until `stop` is called, none is left, or `end` (Unix ns) is reached."""
        queue, self._stopped = self._queue, False
        while queue and queue[0][0] <= end and not self._stopped:
            self.now, _, action, argument = heappop(queue)
            action(argument)

    def stop(self) -> None:
        """Let `run` return after the current event."""
        self._stopped = True
