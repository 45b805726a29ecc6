"""Time that jumps: an event queue in place of a clock, in integer ns, and what the clock of one process shows of it."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any

from flockwire.domain.time import SECOND

Action = Callable[[Any], None]


class Scheduler:
    """Calls actions at their times; those of one time in the order in which they were scheduled."""

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
        """Go from event to event until `stop` is called, nothing is left, or `end` (Unix ns) is reached."""
        queue, self._stopped = self._queue, False
        while queue and queue[0][0] <= end and not self._stopped:
            self.now, _, action, argument = heappop(queue)
            action(argument)

    def stop(self) -> None:
        """Let `run` return after the present event."""
        self._stopped = True


class LocalClock:
    """Shows local = true + offset + correction + drift (true - epoch), in ns; `drift` is in ns per s."""

    def __init__(self, epoch: int, offset: int = 0, drift: int = 0) -> None:
        self._epoch, self._offset, self._drift = epoch, offset, drift
        self._correction = 0

    def read(self, true: int) -> int:
        """Return what it shows at the time `true` (Unix ns)."""
        drift = self._drift
        return true + self._offset + self._correction + (drift * (true - self._epoch) // SECOND if drift else 0)

    def correct(self, correction: int) -> None:
        """Add `correction` ns to what it would show: how far it is behind the swarm's."""
        self._correction = correction

    def step(self, by: int) -> None:
        """Set it forward by `by` ns (back when negative)."""
        self._offset += by

    def true_length(self, local: int) -> int:
        """Return how long, in true ns, `local` ns last on it."""
        return local * SECOND // (SECOND + self._drift)
