"""Finds missing, repeated and late frames, and restarts of a stream, from frame numbers."""

from __future__ import annotations

from collections import Counter, deque

WINDOW = 32  # frames that one may be late: networks reorder by few; a recording played in a loop jumps by more
MISSING, LATE, RESTARTS = "frames missing", "frames late", "stream restarts"


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

    def arrived(self, number: int) -> bool:
        """Count the frame `number`; return whether it is newer than all before."""
        if self._last is None or number > self._last:
            self._counts[MISSING] += 0 if self._last is None else number - self._last - 1
        elif self._last - number < WINDOW:
            self._behind(number)
            return False
        elif self._restart is not None and 0 < number - self._restart <= WINDOW:
            self._counts[RESTARTS] += 1
            self._recent.clear()
        else:
            self._restart = number
            self._counts[LATE] += 1
            return False
        self._last, self._restart = number, None
        self._recent.append(number)
        return True

    def _behind(self, number: int) -> None:
        if number in self._recent:
            self._counts["frames repeated"] += 1
            return
        self._recent.append(number)
        self._counts[LATE] += 1
        self._counts[MISSING] = max(0, self._counts[MISSING] - 1)
