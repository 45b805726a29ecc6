"""Whether a body that may be another drone's moves as this drone does.

The stopping point y of an airframe obeys y' = u + w (state.py), w the wind and what its model lacks. A pilot
that steers by the pose of another drone sees that drone's motion instead: if the two have exchanged their names,
y' = −u as they fly away from their places; if the other one hovers, y' = 0; and if it lands, the height z of the pose
falls, but not the height h that the own airframe measures.

    R = y(t) − y(s) − ∫_s^t u,   U = ∫_s^t u   (horizontal parts)
    the body is not the drone's if, for any s in the last 2 s,
    |R| > 0.4 m + w (t − s) + 0.2 |U|   or   |z(t) − z(s) − h(t) + h(s)| > 0.8 m,   w = 0.5 v        (ours)

v is the drone's largest speed. The terms allow for noise and a wrong lag, for a wind w (or the one to be compensated,
if it is stronger), for a gain that is wrong by 20 %, and for a box below the drone. At the speed v an exchange shows
after 0.3 m / v, a body that hovers after 1.3 m / v.
"""

from __future__ import annotations

from collections import deque
from math import hypot
from typing import NamedTuple

from flockwire.domain.vector import Vector

WINDOW = 2.0  # s
OFFSET = 0.4  # m
WIND = 0.5  # of the largest speed
GAIN_ERROR = 0.2
BOX = 0.8  # m


class Seen(NamedTuple):
    """What was seen at a time, s: y and the integral of u, m; the height of the floor, z − h, m."""

    at: float
    stopping: Vector
    travelled: Vector
    floor: float


class Response:
    """The test of one body, of a drone with the largest speed `speed` in a wind of at most `wind`, m/s.

    `path`, m, is that of the commands since the beginning.
    """

    def __init__(self, speed: float, wind: float) -> None:
        self.path = 0.0
        self._wind = max(WIND * speed, wind)
        self._seen: deque[Seen] = deque()

    def reset(self) -> None:
        """Forget the window: the drone does not fly freely, or its position is not known."""
        self._seen.clear()

    def update(self, stopping: Vector, travelled: Vector, floor: float, now: float) -> float:
        """Return the speed, m/s, at which the body moves apart from the drone; 0 while it can be the drone's.

        `stopping` is y, `travelled` the integral of u and `floor` z − h, all m, at `now` (s).
        """
        seen, new = self._seen, Seen(now, stopping, travelled, floor)
        while seen and not 0.0 < now - seen[0].at <= WINDOW:
            seen.popleft()
        if seen:
            self.path += hypot(*_level(seen[-1].travelled, travelled))
        apart = max([self._apart(before, new) for before in seen], default=0.0)
        seen.append(new)
        return apart

    def _apart(self, before: Seen, after: Seen) -> float:
        elapsed = after.at - before.at
        x, y = _level(before.stopping, after.stopping)
        u, v = _level(before.travelled, after.travelled)
        residual = hypot(x - u, y - v)
        if residual > OFFSET + self._wind * elapsed + GAIN_ERROR * hypot(u, v):
            return residual / elapsed
        step = abs(after.floor - before.floor)
        return step / elapsed if step > BOX else 0.0


def _level(before: Vector, after: Vector) -> tuple[float, float]:
    """Return the horizontal part of a displacement."""
    return after[0] - before[0], after[1] - before[1]
