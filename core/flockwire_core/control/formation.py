"""Formations: each follower's offset h_i(t) from the leader and its rate h_i'(t), by rank 0 … count − 1.

In a change from one formation to another in flight, offsets and their rates stay continuous.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import Protocol

from flockwire_core.domain.record import Frozen
from flockwire_core.domain.vector import Vector


class Formation(Protocol):
    """The interface of formations."""

    @property
    def count(self) -> int:
        """The number of followers."""

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""


@dataclass(frozen=True, slots=True)
class Circle(Frozen):
    """The paper's rotating circle: `radius` r in m, `rate` w in rad/s, clockwise from above for w > 0.

    h_i(t) = [r sin(w t + 2 pi i / count), r cos(w t + 2 pi i / count), 0],   i = 0 … count − 1
    """

    count: int
    radius: float
    rate: float

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        angle = self.rate * t + index * 2 * pi / self.count
        return (self.radius * sin(angle), self.radius * cos(angle), 0.0)

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        angle = self.rate * t + index * 2 * pi / self.count
        speed = self.radius * self.rate
        return (speed * cos(angle), -speed * sin(angle), 0.0)


@dataclass(frozen=True, slots=True)
class Turning(Frozen):
    """A rigid figure round the leader: `places` in its plane (x, y in m, by rank), turned about Z.

    Its angle is `heading` + `rate` t, rad, counter-clockwise from above for rate > 0.
    """

    places: tuple[tuple[float, float], ...]
    heading: float
    rate: float

    @property
    def count(self) -> int:
        """The number of followers."""
        return len(self.places)

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        x, y = self.places[index]
        angle = self.heading + self.rate * t
        c, s = cos(angle), sin(angle)
        return (c * x - s * y, s * x + c * y, 0.0)

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        x, y, _ = self.offset(index, t)
        return (-self.rate * y, self.rate * x, 0.0)


def line(count: int, spacing: float, heading: float, rate: float) -> Turning:
    """Return a line through the leader: followers at +1, −1, +2, −2 … times `spacing` (m) along `heading` (from X)."""
    steps = [(index // 2 + 1) * spacing for index in range(count)]
    return Turning(tuple([(-step if index % 2 else step, 0.0) for index, step in enumerate(steps)]), heading, rate)


def grid(count: int, spacing: float, columns: int, rate: float) -> Turning:
    """Return rows of `columns` cells, `spacing` m apart, filled from the front (+X) left (+Y).

    The leader has a middle cell.
    """
    columns = min(columns, count + 1)
    last_row = count // columns
    # Every row but the last is full, so this cell is within the grid.
    leader_row, leader_column = last_row // 2, columns // 2
    leader = leader_row * columns + leader_column
    cells = [divmod(index + (index >= leader), columns) for index in range(count)]
    places = [((leader_row - row) * spacing, (leader_column - column) * spacing) for row, column in cells]
    return Turning(tuple(places), 0.0, rate)


def polygon(count: int, sides: int, radius: float, rate: float) -> Turning:
    """Return a regular polygon, followers evenly spread along its perimeter from a corner on +X, counter-clockwise.

    `sides` >= 3 and the circumscribed circle's `radius` in m.
    """
    places = list[tuple[float, float]]()
    for index in range(count):
        corner, remainder = divmod(index * sides, count)
        share = remainder / count
        start, end = corner * 2 * pi / sides, (corner + 1) * 2 * pi / sides
        x, y = (1 - share) * cos(start) + share * cos(end), (1 - share) * sin(start) + share * sin(end)
        places.append((radius * x, radius * y))
    return Turning(tuple(places), 0.0, rate)


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

    before: Formation
    places_before: tuple[int, ...]
    after: Formation
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
