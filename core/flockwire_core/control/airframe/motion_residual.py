"""Whether a tracked body moves as its drone is commanded.

The stopping point y of an airframe obeys y' = g u + w (state.py), w the wind and g its gain, about 1. If two drones
have exchanged their names, y' = −u; if the body is another drone's that hovers, y' = 0; and if that one lands, the
height z of the pose falls, but not the height h that the own airframe measures.

    R = y(t) − y(s) − U,   U = ∫_s^t u   (horizontal parts)
    the body is not the drone's if, for some s in the last 2 s,
    |R| > 0.4 m + d (t − s) + 0.3 |U| + 0.6 (lag + D) |v(t) − v(s)|   or
    |z(t) − z(s) − h(t) + h(s)| > 0.8 m + a |v_z|                                                       (ours)

The terms allow for a wind of d, for a gain that is wrong by 30 %, for a lag that is wrong by 60 %, for a box below the
drone and for a time a between h and z. A body that a tracker moves away more slowly than d looks like one in a wind.

A position that stays equal, bit for bit, from s on is that of a drone whose commands and wind balance. It is not the
drone's if the commands changed since, or if they were steady at u_0 while it flew at v, and it can hardly have stopped:

    |∫_s^{t−T} (u − u(s))| > 0.05 m + 0.02 m/s (t − T − s)   or, with U' = ∫_s^{t−T} (u − u_0),
    |U' + v (t − T − s)| > 0.05 m + 0.2 m/s (t − T − s) + 0.3 |U'|,   T = 0.15 s + 1.6 (lag + D)         (ours)
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from math import sqrt
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector, add, distance, norm, scale, subtract

WINDOW: Final = 2.0  # s
GAIN_ERROR: Final = 0.3
LAG_ERROR: Final = 0.6
UNMOVED: Final = 0.05  # m of motion that need not show


@mypyc_attr(acyclic=True)
class Moved(Record):
    """What was seen `at` a time, s: the motion, and the integral of the commands, m."""

    __slots__ = ("at", "motion", "travelled")

    def __init__(self, at: float, motion: Motion, travelled: Vector) -> None:
        self.at: Final = at
        self.motion: Final = motion
        self.travelled: Final = travelled


class MotionResidual:
    """The residual of one drone in a wind of at most `drift`, m/s; `slowness` is its lag + D, s."""

    def __init__(self, drift: float, slowness: float) -> None:
        self._drift, self._slowness = drift, slowness
        self._shows_after = 0.15 + (1.0 + LAG_ERROR) * slowness  # s for which a slow tracker may repeat a position
        self._moved: deque[Moved] = deque()
        self._floors: deque[tuple[float, float, float]] = deque()  # s, z − h, m, and how uncertain that is, m

    def reset(self) -> None:
        """Forget the motion: the drone does not fly freely, or its position is not known."""
        self._moved.clear()

    def forget_heights(self) -> None:
        """Forget the heights: that of the airframe, or its position, is not known."""
        self._floors.clear()

    def update(self, motion: Motion, travelled: Vector, now: float) -> None:
        """Receive the `motion` and the integral of the commands, m, at `now` (s)."""
        moved = self._moved
        while moved and not 0.0 < now - moved[0].at <= WINDOW:
            moved.popleft()
        moved.append(Moved(now, motion, travelled))

    def apart(self) -> float:
        """Return the speed, m/s, at which the body moves apart from the commands; 0 while it can be the drone's."""
        return max([self._apart(before, self._moved[-1]) for before in self._moved], default=0.0)

    def repeats(self, heard: float) -> bool:
        """Return whether its position is one that the tracker repeats, since the drone `heard` (s) all commands."""
        moved = list(self._moved)
        first = last = len(moved) - 1
        while first > 0 and moved[first - 1].motion.position == moved[last].motion.position:
            if moved[first - 1].at < heard:
                break
            first -= 1
        end = last
        while end > first and moved[end].at > moved[last].at - self._shows_after:
            end -= 1
        if end == first:
            return False
        elapsed = moved[end].at - moved[first].at
        since = _beside(moved[first], moved[end], _rate(moved[first], moved[first + 1]))
        if norm(since) > UNMOVED + 0.02 * elapsed:  # m/s of commands that an airframe may not obey
            return True
        if first < 2 or not self._was_steady(moved[:first]):
            return False
        before, after = moved[first - 2], moved[first - 1]
        speed = scale(subtract(after.motion.position, before.motion.position), 1.0 / (after.at - before.at))
        less = _beside(moved[first], moved[end], _rate(before, after))
        goes_on = norm(add(less, scale(speed, elapsed)))
        return goes_on > UNMOVED + 0.2 * elapsed + GAIN_ERROR * norm(less)  # m/s that steady commands may lose

    def _was_steady(self, moved: list[Moved]) -> bool:
        """Return whether the commands did not change, for as long as the drone takes to show them."""
        now, steady = moved[-1], _rate(moved[-2], moved[-1])
        # s, between two updates
        rates = [_rate(a, b) for a, b in pairwise(moved) if a.at > now.at - self._shows_after - 0.1]
        # m/s of commands that count as steady
        return all(distance(rate, steady) <= 0.1 + GAIN_ERROR * norm(steady) for rate in rates)

    def rise(self, motion: Motion, height: float, age: float, now: float) -> float:
        """Return how far, m, the body rose or sank apart from the airframe; 0 while it can be the drone's.

        `height` is h, m, measured `age` s before or after the position of `now` (s).
        """
        floors, floor, unsure = self._floors, motion.position[2] - height, age * abs(motion.velocity[2])
        while floors and not 0.0 < now - floors[0][0] <= WINDOW:
            floors.popleft()
        step = max([abs(floor - before) - max(unsure, other) for _, before, other in floors], default=0.0)
        floors.append((now, floor, unsure))
        return step if step > 0.8 else 0.0  # m

    def _apart(self, before: Moved, after: Moved) -> float:
        elapsed, was, now = after.at - before.at, before.motion, after.motion
        ux, uy = after.travelled[0] - before.travelled[0], after.travelled[1] - before.travelled[1]
        vx, vy = now.velocity[0] - was.velocity[0], now.velocity[1] - was.velocity[1]
        x, y = now.stopping[0] - was.stopping[0] - ux, now.stopping[1] - was.stopping[1] - uy
        slow = LAG_ERROR * self._slowness * sqrt(vx * vx + vy * vy)
        residual = sqrt(x * x + y * y)
        most = 0.4 + self._drift * elapsed + GAIN_ERROR * sqrt(ux * ux + uy * uy) + slow  # m
        return residual / elapsed if residual > most else 0.0


def _rate(before: Moved, after: Moved) -> Vector:
    """Return the mean command between two times, m/s."""
    return scale(subtract(after.travelled, before.travelled), 1.0 / (after.at - before.at))


def _beside(before: Moved, after: Moved, rate: Vector) -> Vector:
    """Return the integral of the commands between two times less a constant `rate` (m/s), m."""
    return subtract(subtract(after.travelled, before.travelled), scale(rate, after.at - before.at))
