"""Maps a source's clock to the local clock: the smallest delay counts as zero, and the drift is followed.

Network and queues only ever delay, so the smallest differences between arrival and stamp lie on a line whose slope is
the drift: the lower convex hull of all differences, as in S. Moon, P. Skelly, D. Towsley, "Estimation and removal of
clock skew from network delay measurements", INFOCOM 1999. Only the smallest difference of each block of time enters.
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise

from flockwire_core.domain.time import SECOND

DelayPoint = tuple[int, int]  # source time, local minus source time; ns

BLOCK = SECOND  # ns of the source's clock for each kept point
SLOPE_BLOCKS = 10  # blocks from which on the slope is used; before, the line is level
DRIFT_LIMIT = 500e-6  # above any quartz
STEP = SECOND  # ns; a source whose clock jumps by more has been restarted
STEP_PATIENCE = SECOND  # ns for which a step back must last; a full queue empties sooner


class SourceClock:
    """Maps stamps of one source to local time; `steps` counts how often its clock has jumped.

    No stamp is mapped to a local time after its arrival. The smallest delay, and half of any lasting change of route,
    cannot be observed from one side and remains in the result.
    """

    def __init__(self) -> None:
        self.steps = 0
        self._points: deque[DelayPoint] = deque(maxlen=60)  # blocks under the line
        self._slope = 0.0
        self._base: DelayPoint | None = None  # a point of the line
        self._behind_since: int | None = None

    def update(self, source_time: int, local_now: int, set_back: bool = False) -> int:
        """Record that a message stamped `source_time` arrived at `local_now`, ns; return its stamp in local time, ns.

        With `set_back` the source's clock is known to have been set back: without it a step of less than STEP cannot be
        distinguished from a longer delay, and old data must not look new.
        """
        difference = local_now - source_time
        if self._base is None:
            self._begin(source_time, difference)
        elif self._stepped(source_time, difference, local_now, set_back):
            self.steps += 1
            self._begin(source_time, difference)
        else:
            self._take_in(source_time, difference)
        return self.local(source_time)

    def local(self, source_time: int) -> int:
        """Return the local time, ns, of a stamp of the source, ns; the stamp itself before the first update."""
        if self._base is None:
            return source_time
        origin, offset = self._base
        return source_time + offset + round(self._slope * (source_time - origin))

    def _begin(self, source_time: int, difference: int) -> None:
        self._points.clear()
        self._points.append((source_time, difference))
        self._base, self._slope, self._behind_since = (source_time, difference), 0.0, None

    def _stepped(self, source_time: int, difference: int, local_now: int, set_back: bool) -> bool:
        """Return whether the source's clock has jumped: ahead, which no delay causes, or back for STEP_LASTS."""
        excess = difference - (self.local(source_time) - source_time)
        # ns; a clock that was set back is followed if it is off by more than this
        if set_back and excess > SECOND // 100:
            return True
        if excess <= STEP:
            self._behind_since = None
            return excess < -STEP
        if self._behind_since is None:
            self._behind_since = local_now
        return local_now - self._behind_since > STEP_PATIENCE

    def _take_in(self, source_time: int, difference: int) -> None:
        newest, least = self._points[-1]
        if source_time // BLOCK > newest // BLOCK:
            self._lay_line()
            self._points.append((source_time, difference))
        elif difference < least and source_time // BLOCK == newest // BLOCK:
            self._points[-1] = (source_time, difference)
        below = self.local(source_time) - source_time - difference
        if below > 0 and self._base is not None:
            self._base = (self._base[0], self._base[1] - below)

    def _lay_line(self) -> None:
        """Fit the line to the edge of the points' lower hull at the middle of their time."""
        hull = lower_hull(self._points)
        middle = (self._points[0][0] + self._points[-1][0]) / 2
        edge = next((pair for pair in pairwise(hull) if pair[1][0] >= middle), None)
        if edge is None or len(self._points) < SLOPE_BLOCKS:
            self._base, self._slope = min(self._points, key=lambda point: point[1]), 0.0
            return
        (a, at_a), (b, at_b) = edge
        slope = (at_b - at_a) / (b - a)
        self._slope = min(DRIFT_LIMIT, max(-DRIFT_LIMIT, slope))
        self._base = min(self._points, key=lambda point: point[1] - self._slope * (point[0] - a))


def lower_hull(points: deque[DelayPoint]) -> list[DelayPoint]:
    """Return the corners of the lower convex hull of points in the order of their time (Andrew's monotone chain)."""
    hull: list[DelayPoint] = []
    for x, y in points:
        while len(hull) > 1 and _turns_right(hull[-2], hull[-1], (x, y)):
            hull.pop()
        hull.append((x, y))
    return hull


def _turns_right(a: DelayPoint, b: DelayPoint, c: DelayPoint) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) <= (b[1] - a[1]) * (c[0] - a[0])
