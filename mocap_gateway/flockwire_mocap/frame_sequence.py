"""What frame numbers say of a stream: frames that are missing, come twice, or come late."""

from __future__ import annotations

from collections import deque
from enum import Enum, auto

MEMORY = 256  # frame numbers kept, to tell a repeated frame from a late one
RESTART = 1000  # frames; a number that lies further back belongs to a stream that has begun again


class Arrival(Enum):
    """How a frame fits into the sequence."""

    NEXT = auto()
    REPEATED = auto()
    LATE = auto()


class FrameSequence:
    """Counts `missing`, `repeated`, `late` frames and `restarts` of a stream whose numbers count up by one.

    A frame that comes late was counted as missing before and no longer is. After a restart all is counted on.
    """

    def __init__(self) -> None:
        self.missing = self.repeated = self.late = self.restarts = 0
        self._last: int | None = None
        self._recent: deque[int] = deque(maxlen=MEMORY)

    def arrived(self, number: int) -> Arrival:
        """Count the frame `number`; only one that is NEXT is newer than all before."""
        if self._last is not None and number <= self._last:
            if number in self._recent:
                self.repeated += 1
                return Arrival.REPEATED
            if self._last - number < RESTART:
                self._recent.append(number)
                self.late += 1
                self.missing = max(0, self.missing - 1)
                return Arrival.LATE
            self.restarts += 1
            self._recent.clear()
        elif self._last is not None:
            self.missing += number - self._last - 1
        self._last = number
        self._recent.append(number)
        return Arrival.NEXT
