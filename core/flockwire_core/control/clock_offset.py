"""The offset between two clocks, from the four stamps of requests and replies (RFC 5905, section 8).

    t1 request sent (own clock)     t2 request received (reference clock)
    t4 reply received (own clock)   t3 reply sent (reference clock)

With theta = reference - own and delays d_out, d_back >= 0, each direction bounds theta from its own side:

    t2 - t1 = theta + d_out >= theta        t3 - t4 = theta - d_back <= theta

Over a window theta is a line theta(t) = a + s (t - now), |s| <= DRIFT, below all points of the first kind and above all
of the second. All such lines bound theta(now). The estimate is the middle of the lines with about the most room between
the two kinds; over a short window, the single best line would depend on noise. Each direction reaches its shortest
delay separately, much sooner than one round trip reaches both. On links with equal shortest delays the error is a small
part of the bound, which is valid on any link.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from flockwire_core.domain.time import SECOND

DRIFT = 100e-6  # s per s, largest drift between two clocks: twice that of a quartz
SLOPES = tuple(DRIFT * k / 8 for k in range(-8, 9))
ENOUGH = 4  # replies before the offset is known

Point = tuple[int, int]  # value and time, ns


class Offset(NamedTuple):
    """The reference clock minus the own one, ns, and its bound."""

    offset: int
    bound: int


class OffsetEstimator:
    """Estimates the offset from replies. The best reply of each second and direction is kept."""

    def __init__(self) -> None:
        self._above: dict[int, Point] = {}  # t2 - t1, by the second
        self._below: dict[int, Point] = {}  # t4 - t3
        self._replies = 0

    def add(self, t1: int, t2: int, t3: int, t4: int) -> bool:
        """Add the stamps of one round trip, ns; returns False if they are impossible."""
        if not 0 <= t3 - t2 <= t4 - t1:
            return False
        second = t4 // SECOND
        for points, value in ((self._above, t2 - t1), (self._below, t4 - t3)):
            points[second] = min(points.get(second, (value, t4)), (value, t4))
            while second - next(iter(points)) > 60:  # s
                del points[next(iter(points))]
        self._replies += 1
        return True

    def estimate(self, now: int) -> Offset | None:
        """Return the offset at `now`, ns of the own clock; None before ENOUGH replies.

        If no line fits, a clock was set: all replies are dropped.
        """
        if self._replies < ENOUGH:
            return None
        lines = [(_lowest(self._above.values(), s, now), -_lowest(self._below.values(), -s, now)) for s in SLOPES]
        fitting = [(above - below, above, below) for above, below in lines if above >= below]
        if not fitting:
            self._above, self._below, self._replies = {}, {}, 0
            return None
        rooms, highest, lowest = zip(*fitting, strict=True)
        least = max(rooms) - 1_000_000  # ns below the largest room of a line that are as likely
        _, high, low = zip(*[line for line in fitting if line[0] >= least], strict=True)
        offset = round((max(high) + min(low)) / 2)
        return Offset(offset, round(max(max(highest) - offset, offset - min(lowest))))


def _lowest(points: Iterable[Point], slope: float, now: int) -> float:
    """Return the lowest value at `now` of lines of `slope` through `points`."""
    return min([value + slope * (now - when) for value, when in points])
