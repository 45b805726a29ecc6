"""Formations: each follower's offset h_i(t) from the leader and its rate h_i'(t), by rank 0 … count − 1."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, nan, pi, sin

from flockwire_core.control.expression import Node, bound, derivative, function_of_time
from flockwire_core.control.formation_change import FormationChange
from flockwire_core.control.key_frames import KeyFrames
from flockwire_core.domain.frozen import Frozen
from flockwire_core.domain.vector import Vector

_Axis = Callable[[float], float]


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
class Line(Frozen):
    """A line through the leader: followers at +1, −1, +2, −2 … times `spacing` (m) along `heading` (rad from X).

    It turns about Z at `rate` rad/s, counter-clockwise from above for rate > 0.
    """

    count: int
    spacing: float
    heading: float
    rate: float

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        return _turned(self._place(index), self.heading + self.rate * t)

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        return _turned_rate(self._place(index), self.heading + self.rate * t, self.rate)

    def _place(self, index: int) -> tuple[float, float]:
        step = (index // 2 + 1) * self.spacing
        return (step if index % 2 == 0 else -step, 0.0)


@dataclass(frozen=True, slots=True)
class Grid(Frozen):
    """Rows of `columns` cells, `spacing` m apart, filled from the front (+X) left (+Y); the leader has a middle cell.

    It turns about Z round the leader at `rate` rad/s, counter-clockwise from above for rate > 0.
    """

    count: int
    spacing: float
    columns: int
    rate: float

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        return _turned(self._place(index), self.rate * t)

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        return _turned_rate(self._place(index), self.rate * t, self.rate)

    def _place(self, index: int) -> tuple[float, float]:
        columns = min(self.columns, self.count + 1)
        last_row = self.count // columns
        # Every row but the last is full, so this cell is within the grid.
        leader_row, leader_column = last_row // 2, columns // 2
        row, column = divmod(index + (index >= leader_row * columns + leader_column), columns)
        return ((leader_row - row) * self.spacing, (leader_column - column) * self.spacing)


@dataclass(frozen=True, slots=True)
class Polygon(Frozen):
    """A regular polygon round the leader, followers evenly spread along its perimeter from a corner on +X.

    `sides` >= 3 and the circumscribed circle's `radius` in m. It turns about Z at `rate` rad/s, counter-clockwise from
    above for rate > 0, which is also the order of the ranks.
    """

    count: int
    sides: int
    radius: float
    rate: float

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        return _turned(self._place(index), self.rate * t)

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        return _turned_rate(self._place(index), self.rate * t, self.rate)

    def _place(self, index: int) -> tuple[float, float]:
        corner, remainder = divmod(index * self.sides, self.count)
        share = remainder / self.count
        start, end = corner * 2 * pi / self.sides, (corner + 1) * 2 * pi / self.sides
        return (
            self.radius * ((1 - share) * cos(start) + share * cos(end)),
            self.radius * ((1 - share) * sin(start) + share * sin(end)),
        )


class Parametric:
    """An expression for each axis: h_i(t) = [x, y, z](t, i, n) in m, t >= 0 in s, of rank i = 0 … n − 1, n = `count`.

    `axes` are the trees of x, y and z; h_i' is their derivative. An undefined value is NaN. Raises ExpressionError if
    the derivative would jump.
    """

    def __init__(self, count: int, axes: tuple[Node, Node, Node]) -> None:
        self.count = count
        self._axes = axes
        self._rates = tuple(derivative(axis) for axis in axes)
        self._places: dict[int, tuple[_Axis, ...]] = {}  # x, y, z and their rates, by rank

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        x, y, z, _, _, _ = self._places.get(index) or self._place(index)
        t = max(t, 0.0)
        return (_worth(x, t), _worth(y, t), _worth(z, t))

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        _, _, _, x, y, z = self._places.get(index) or self._place(index)
        t = max(t, 0.0)
        return (_worth(x, t), _worth(y, t), _worth(z, t))

    def _place(self, index: int) -> tuple[_Axis, ...]:
        ranks = {"i": float(index), "n": float(self.count)}
        place = tuple(function_of_time(bound(tree, ranks)) for tree in (*self._axes, *self._rates))
        self._places[index] = place
        return place


Formation = Circle | Line | Grid | Polygon | KeyFrames | Parametric | FormationChange


def _turned(place: tuple[float, float], angle: float) -> Vector:
    x, y = place
    c, s = cos(angle), sin(angle)
    return (c * x - s * y, s * x + c * y, 0.0)


def _turned_rate(place: tuple[float, float], angle: float, rate: float) -> Vector:
    x, y, _ = _turned(place, angle)
    return (-rate * y, rate * x, 0.0)


def _worth(axis: _Axis, t: float) -> float:
    try:
        return axis(t)
    except (ValueError, ArithmeticError):
        return nan
