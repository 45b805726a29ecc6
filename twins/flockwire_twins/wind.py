"""The wind of simulated airframes: by how much they drift at a zero command.

    w(t) = mean + gust / sqrt 2 sum_k c_k [sin(2 pi t / T_k + a_k), sin(2 pi t / T_k + b_k), 0]
    T = 3, 6, 12, 24, 48 s,   c_k = sqrt T_k / sum sqrt T_k

So a gust is at most `gust`, horizontal, smooth, and other for each drone by its phases a, b. Its power falls with the
square of the frequency, as in Dryden's spectrum of turbulence above its corner: 50 s at 1 m/s and a length of 8 m, that
of 1 m above the ground. A constant command u makes an airframe fly at gain u + w.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sin, sqrt

from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector

PERIODS = (3.0, 6.0, 12.0, 24.0, 48.0)  # s, of the parts of gusts
STEP = SECOND // 100  # ns for which airframes take the wind as constant


class Wind:
    """The wind on one drone: `mean` and most `gust` (m/s, world frame); `chance` draws phases of gusts from [0, 1)."""

    def __init__(self, mean: Vector, gust: float, chance: Callable[[], float]) -> None:
        self._mean = mean
        whole = sqrt(2.0) * sum(map(sqrt, PERIODS))
        self._parts = tuple(
            (gust * sqrt(period) / whole, 2.0 * pi / period, 2.0 * pi * chance(), 2.0 * pi * chance())
            for period in (PERIODS if gust else ())
        )

    def at(self, now: int) -> Vector:
        """Return the wind, m/s, of the step of STEP ns that contains `now` (ns)."""
        t = now // STEP * STEP / SECOND
        x, y, z = self._mean
        for most, rate, a, b in self._parts:
            x, y = x + most * sin(rate * t + a), y + most * sin(rate * t + b)
        return (x, y, z)

    @property
    def blows(self) -> bool:
        """Whether there is any."""
        return any(self._mean) or bool(self._parts)
