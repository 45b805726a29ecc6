"""A change from one formation to another in flight: offsets and their rates stay continuous."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from flockwire_core.domain.frozen import Frozen
from flockwire_core.domain.vector import Vector


class Shape(Protocol):
    """The interface of formations (formation.py)."""

    @property
    def count(self) -> int:
        """The number of followers."""

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""


def blend(s: float) -> float:
    """Return sigma, the weight of the new formation, at the share s in [0, 1] of the change.

        sigma(s) = s^3 (10 − 15 s + 6 s^2)        (ours)

    sigma' and sigma'' are 0 at both ends.
    """
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


def blend_rate(s: float) -> float:
    """Return d sigma / ds = 30 s^2 (1 − s)^2, at most 1.875."""
    return 30.0 * s * s * (1.0 - s) * (1.0 - s)


@dataclass(frozen=True, slots=True)
class FormationChange(Frozen):
    """From `before` to `after`, from mission time `begin` on, for `duration` s; both formations' time continues.

        h_i = (1 − sigma) a_i + sigma b_i,     sigma = sigma((t − begin) / duration)        (ours)

    a_i is the offset of rank `places_before[i]` in `before`, b_i that of rank `places[i]` in `after`.
    """

    before: Shape
    places_before: tuple[int, ...]
    after: Shape
    places: tuple[int, ...]
    begin: float
    duration: float

    @property
    def count(self) -> int:
        """The number of followers."""
        return len(self.places)

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        s = (t - self.begin) / self.duration
        if s >= 1.0:
            return self.after.offset(self.places[index], t)
        a = self.before.offset(self.places_before[index], t)
        if s <= 0.0:
            return a
        b, sigma = self.after.offset(self.places[index], t), blend(s)
        return (a[0] + sigma * (b[0] - a[0]), a[1] + sigma * (b[1] - a[1]), a[2] + sigma * (b[2] - a[2]))

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        s = (t - self.begin) / self.duration
        if s >= 1.0:
            return self.after.offset_rate(self.places[index], t)
        ra = self.before.offset_rate(self.places_before[index], t)
        if s <= 0.0:
            return ra
        a, b = self.before.offset(self.places_before[index], t), self.after.offset(self.places[index], t)
        rb, sigma, rate = self.after.offset_rate(self.places[index], t), blend(s), blend_rate(s) / self.duration
        return (
            ra[0] + sigma * (rb[0] - ra[0]) + rate * (b[0] - a[0]),
            ra[1] + sigma * (rb[1] - ra[1]) + rate * (b[1] - a[1]),
            ra[2] + sigma * (rb[2] - ra[2]) + rate * (b[2] - a[2]),
        )
