"""How far one clock is from another, from the four stamps of requests and their replies (RFC 5905, section 8).

    t1 request sent (own clock)     t2 request received (reference clock)
    t4 reply received (own clock)   t3 reply sent (reference clock)

With theta = reference - own and delays d_out, d_back >= 0, each direction bounds theta from its own side:

    t2 - t1 = theta + d_out >= theta        t3 - t4 = theta - d_back <= theta

Over a window theta is a line theta(t) = a + s (t - now), |s| <= DRIFT, below all points of the first kind and above all
of the second. All such lines bound theta(now); the estimate is the middle of those that leave about the most room
between the two kinds: over a short window noise alone would choose among the slopes. Each direction meets its shortest
delay by itself, which happens far sooner than that one round trip meets both. On links with equal shortest delays the
error is a small part of the bound, which holds on any.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from flockwire.domain.time import SECOND

DRIFT = 100e-6  # s per s by which two clocks drift apart: twice what a quartz is off by
SLOPES = tuple(DRIFT * k / 8 for k in range(-8, 9))
WINDOW = 60  # s
LIKELY = 1_000_000  # ns of room less than the most that a line may have and still be as likely
ENOUGH = 4  # replies before the offset is known

Point = tuple[int, int]  # value and when, ns


class Offset(NamedTuple):
    """The reference clock minus the own one, ns, and by how much that may be wrong."""

    offset: int
    bound: int


class OffsetEstimator:
    """Estimates the offset from the replies that came. Of each second and direction the best one is kept."""

    def __init__(self) -> None:
        self._above: dict[int, Point] = {}  # t2 - t1, by the second
        self._below: dict[int, Point] = {}  # t4 - t3
        self._replies = 0

    def add(self, t1: int, t2: int, t3: int, t4: int) -> bool:
        """Take the stamps of one round trip, ns; returns False when they cannot be of one."""
        if not 0 <= t3 - t2 <= t4 - t1:
            return False
        second = t4 // SECOND
        for points, value in ((self._above, t2 - t1), (self._below, t4 - t3)):
            points[second] = min(points.get(second, (value, t4)), (value, t4))
            while second - next(iter(points)) > WINDOW:
                del points[next(iter(points))]
        self._replies += 1
        return True

    def estimate(self, now: int) -> Offset | None:
        """Return the offset at `now`, ns of the own clock; None before ENOUGH replies.

        When no line fits, one of the two clocks was set: all is forgotten.
        """
        if self._replies < ENOUGH:
            return None
        lines = [(_lowest(self._above.values(), s, now), -_lowest(self._below.values(), -s, now)) for s in SLOPES]
        fitting = [(above - below, above, below) for above, below in lines if above >= below]
        if not fitting:
            self._above, self._below, self._replies = {}, {}, 0
            return None
        room, _, _ = max(fitting)
        likely = [(above, below) for has, above, below in fitting if has >= room - LIKELY]
        offset = round((max(above for above, _ in likely) + min(below for _, below in likely)) / 2)
        highest, lowest = max(line[1] for line in fitting), min(line[2] for line in fitting)
        return Offset(offset, round(max(highest - offset, offset - lowest)))


def _lowest(points: Iterable[Point], slope: float, now: int) -> float:
    """Return the lowest value at `now` of lines of `slope` through `points`."""
    return min([value + slope * (now - when) for value, when in points])
