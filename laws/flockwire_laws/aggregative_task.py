"""The task of `law = "aggregative"`: its cost, and the message of a round."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_core import law as fw

from flockwire_laws.relative import Array

Triple = tuple[float, float, float]


class Tracker(NamedTuple):
    """s and y (m) of one round, in the formation that began at `start` (Unix ns)."""

    start: int
    round: int
    s: Triple
    y: Triple


class Task(fw.Parameters):
    """As in the equations; period of a round in s, b in m."""

    period: fw.Positive = 0.1
    alpha: fw.Positive = 0.05
    weights: tuple[fw.NotNegative, fw.NotNegative, fw.NotNegative] = (1.0, 1.0, 1.0)  # g1, g2, g3
    target: Triple = (0.0, 0.0, 1.0)  # b

    def gradients(self, x: Array, s: Array, r: Triple) -> tuple[Array, Array]:
        """Return grad_1 f(x, s) and grad_2 f(x, s), m."""
        g1, g2, g3 = self.weights
        return g1 * (x - r) + g3 * (x - s), g2 * (s - self.target) - g3 * (x - s)
