"""Walls and obstacles of an arena, and the speed at which one can still stop before them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from flockwire_core.law import BodyKind, Observation

from flockwire_laws.relative import Array, size

Point = tuple[float, float]


def walls(arena: tuple[Point, Point] | None, observation: Observation) -> Iterator[tuple[float, Array]]:
    """Yield the distance (m) and the normal of each wall of a box (low and high corner, m) and of each obstacle."""
    for axis, (low, high) in enumerate(zip(*arena, strict=True) if arena else ()):
        x, normal = np.array(observation.position)[axis], np.eye(3)[axis]
        yield from ((x - low, normal), (high - x, -normal))
    for body in observation.bodies:
        if body.kind is not BodyKind.DRONE and (distance := size(np.array(body.relative_position))):
            yield distance - body.radius, -np.array(body.relative_position) / distance


def braking(r: float, a: float, p: float) -> float:
    """Return D(r, a, p), m/s: the speed at `r` m from a stop, with the acceleration a (m/s^2) and the gain p (1/s)."""
    if r <= 0.0:
        return 0.0
    return r * p if r * p < a / p else float(np.sqrt(2.0 * a * r - a * a / p / p))
