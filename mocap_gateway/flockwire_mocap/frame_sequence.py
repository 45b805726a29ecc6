"""Finds missing, repeated and late frames, and restarts of a stream, from frame numbers."""

from __future__ import annotations

from collections import Counter, deque
from enum import Enum, auto

WINDOW = 32  # frames that one may be late: networks reorder by few; a recording played in a loop jumps by more
MISSING, LATE = "frames missing", "frames late"


class Arrival(Enum):
    """The place of a frame in the sequence."""

    NEXT = auto()
    REPEATED = auto()
    LATE = auto()


class FrameSequence:
    """Counts in `counts` missing, repeated and late frames and restarts of a stream whose numbers count up by one.

    A late frame was counted as missing before and no longer is. A number further behind than WINDOW is late; if a
    second one follows it, the stream has restarted.
    """

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._last: int | None = None
        self._restart: int | None = None  # the newest number far behind, with which a stream may have restarted
        self._recent: deque[int] = deque(maxlen=2 * WINDOW)

    def arrived(self, number: int) -> Arrival:
        """Count the frame `number`; only one that is NEXT is newer than all before."""
        if self._last is None or number > self._last:
            self._counts[MISSING] += 0 if self._last is None else number - self._last - 1
            return self._next(number)
        if self._last - number < WINDOW:
            return self._behind(number)
        if self._restart is not None and 0 < number - self._restart <= WINDOW:
            self._counts["stream restarts"] += 1
            self._recent.clear()
            return self._next(number)
        self._restart = number
        self._counts[LATE] += 1
        return Arrival.LATE

    def _next(self, number: int) -> Arrival:
        self._last, self._restart = number, None
        self._recent.append(number)
        return Arrival.NEXT

    def _behind(self, number: int) -> Arrival:
        if number in self._recent:
            self._counts["frames repeated"] += 1
            return Arrival.REPEATED
        self._recent.append(number)
        self._counts[LATE] += 1
        self._counts[MISSING] = max(0, self._counts[MISSING] - 1)
        return Arrival.LATE
