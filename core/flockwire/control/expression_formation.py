"""A formation given by an expression for each axis."""

from __future__ import annotations

from collections.abc import Callable
from math import nan

from flockwire.control.expression import Node, bound, derivative, function_of_time
from flockwire.control.vector import Vector

_Axis = Callable[[float], float]


class ExpressionFormation:
    """Offsets h_i(t) = [x, y, z](t, i, n) in m, from t = 0 s on, of rank i = 0 … n − 1, n = `count`.

    `axes` are the trees of x, y and z; h_i' is their derivative. What is not defined is NaN. Raises ExpressionError
    where the derivative would jump.
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


def _worth(axis: _Axis, t: float) -> float:
    try:
        return axis(t)
    except (ValueError, ArithmeticError):
        return nan
