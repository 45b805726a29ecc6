"""An event queue instead of a clock, in integer ns, and the clock of one process: with offset, drift and steps."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any

from flockwire_core.domain.time import SECOND

Action = Callable[[Any], None]
Moment = list[tuple[Action, Any]]  # what is called at one time


class Scheduler:
    """Calls actions at their times; those of one time in the order in which they were scheduled.

    Actions that are scheduled one after the other for the same time are one entry of the queue: what a step sends
    arrives at one time.
    """

    def __init__(self, now: int) -> None:
        self.now = now  # true time, Unix ns
        self._queue: list[tuple[int, int, Moment]] = []
        self._count = 0
        self._last: Moment = []  # the entry that was made last
        self._last_time = -1  # of that entry, -1 once it has begun
        self._stopped = False

    def at(self, time: int, action: Action, argument: object = None) -> None:
        """Call `action(argument)` at `time` (Unix ns), which has not passed."""
        if time == self._last_time:
            self._last.append((action, argument))
            return
        self._count += 1
        self._last, self._last_time = [(action, argument)], time
        heappush(self._queue, (time, self._count, self._last))

    def run(self, end: int) -> None:
        """Run events until `stop` is called, none is left, or `end` (Unix ns) is reached."""
        queue, self._stopped = self._queue, False
        while queue and queue[0][0] <= end and not self._stopped:
            self.now, count, moment = heappop(queue)
            if moment is self._last:
                self._last_time = -1
            done = 0
            for action, argument in moment:
                action(argument)
                done += 1
                if self._stopped:
                    break
            if done < len(moment):
                heappush(queue, (self.now, count, moment[done:]))

    def stop(self) -> None:
        """Let `run` return after the current event."""
        self._stopped = True


class LocalClock:
    """Shows local = true + offset + correction + drift (true - epoch), in ns; `drift` is in ns per s."""

    def __init__(self, epoch: int, offset: int = 0, drift: int = 0) -> None:
        self._epoch, self._offset, self._drift = epoch, offset, drift
        self._correction = 0

    def read(self, true: int) -> int:
        """Return its time at the true time `true` (Unix ns)."""
        drift = self._drift
        return true + self._offset + self._correction + (drift * (true - self._epoch) // SECOND if drift else 0)

    def correct(self, correction: int) -> None:
        """Add `correction` ns, its lag behind the swarm's clock."""
        self._correction = correction

    def step(self, by: int) -> None:
        """Set it forward by `by` ns (back if negative)."""
        self._offset += by

    def true_length(self, local: int) -> int:
        """Return the true ns of `local` ns on it."""
        return local * SECOND // (SECOND + self._drift)
