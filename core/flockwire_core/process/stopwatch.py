"""Measures how long the steps of a law take in real time; no core decides by it."""

from __future__ import annotations

from collections.abc import Callable

from flockwire_core.domain.time import SECOND
from flockwire_core.wire.status import Reason

SLOW = "law slow"  # the code of the reason
TAKES = "its law takes {step:.0f} ms for a step, the control period is {period:g} ms: steps are missed"


class Stopwatch:
    """Measures steps by the clock `read` (ns); they are due every `period` s."""

    def __init__(self, read: Callable[[], int], period: float) -> None:
        self._read, self._period = read, period
        self._began = self._spent = self._steps = 0
        self._slowest = 0.0

    def begin(self) -> None:
        """Note that a step begins."""
        self._began = self._read()

    def end(self) -> None:
        """Note that it ends."""
        self._spent += self._read() - self._began
        self._steps += 1

    def reason(self) -> Reason | None:
        """Return the reason that names the longest mean so far, if the steps since the last call took too long."""
        mean = self._spent / (max(self._steps, 1) * SECOND)
        self._spent = self._steps = 0
        if mean <= self._period:
            return None
        self._slowest = max(self._slowest, mean)
        return Reason(SLOW, TAKES.format(step=1e3 * self._slowest, period=1e3 * self._period))
