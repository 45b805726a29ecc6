"""The deadlock breaker: a drone that a body blocks turns to one side, every drone to the same one."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, hypot, pi, sin

from flockwire.control.vector import Vector


def sidestep(wanted: Vector, bodies: Iterable[tuple[Vector, float]], reach: float, side: float) -> Vector:
    """Return `wanted`, m/s, turned about Z away from what blocks it.

        theta = (pi/2) max_k  s_k max(0, −û·n_k),   s_k = clamp(2 (1 − g_k / reach), 0, 1)        (ours)

    `bodies` are (n_k, g_k): the unit vector from the body to us, and the gap in m beyond the safety distance; bodies
    farther than `reach` do not block. `side` +1 turns to the right, −1 to the left. Two drones face to face both give
    way to the same hand and pass; many that meet in one place go round it like traffic round an island.
    """
    speed = hypot(wanted[0], wanted[1])
    if speed < 1e-6:
        return wanted
    ux, uy = wanted[0] / speed, wanted[1] / speed
    blocked = 0.0
    for (nx, ny, _), gap in bodies:
        if gap < reach:
            near = min(2.0 * (1.0 - gap / reach), 1.0)
            blocked = max(blocked, -near * (ux * nx + uy * ny))
    if blocked <= 0.0:
        return wanted
    angle = -side * 0.5 * pi * blocked
    c, s = cos(angle), sin(angle)
    return (c * wanted[0] - s * wanted[1], s * wanted[0] + c * wanted[1], wanted[2])


class Impatience:
    """Which side to turn to: the other one after `patience` s in which the goal has come no nearer."""

    def __init__(self, patience: float) -> None:
        self._patience, self._best, self._since = patience, 0.0, 0.0
        self.side = 1.0

    def update(self, distance: float, blocked: bool, now: float) -> float:
        """Return the side at `now` (s); `distance` m from the goal, `blocked` when something is in the way."""
        if not blocked or distance < self._best - 0.1:
            self._best, self._since = distance, now
            if not blocked:
                self.side = 1.0
        elif now - self._since > self._patience:
            self.side, self._best, self._since = -self.side, distance, now
        return self.side
