"""Two places against each other: h_i − h_j, its rate and its acceleration, and z_j − z_i, all in world axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from flockwire_core.law import Heard, LeaderMotion, Place, Seen
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 1e-4  # s, of the central differences: an error of about 2e-9 times the fourth derivative of h


class Acceleration(NamedTuple):
    """What a drone commands, or a leader flies, m/s^2: the message of a law that feeds it forward."""

    acceleration: tuple[float, float, float]


class Velocity(NamedTuple):
    """Likewise, m/s."""

    velocity: tuple[float, float, float]


def flown_acceleration(t: float, motion: LeaderMotion) -> Acceleration:
    """Return a leader's message: what it flies."""
    return Acceleration(motion.acceleration)


def flown_velocity(t: float, motion: LeaderMotion) -> Velocity:
    """Return a leader's message: what it flies."""
    return Velocity(motion.velocity)


def weighted(ones: Sequence[Seen] | Sequence[Heard], of: Callable[[Any], Any]) -> tuple[Array, float]:
    """Return sum_j w_ij of(j), shape (3,), and sum_j w_ij."""
    total = np.zeros(3)
    for one in ones:
        total += one.weight * np.asarray(of(one))
    return total, sum(one.weight for one in ones)


def vector(array: Array) -> tuple[float, float, float]:
    """Return three numbers as a message holds them."""
    return (float(array[0]), float(array[1]), float(array[2]))


def apart(place: Place, seen: Seen, t: float) -> Array:
    """Return z_j − z_i = (p_j − p_i) + (h_i − h_j), m, at `t` s."""
    return np.array(seen.position) + place.to(seen.number, t)


def derivatives(place: Place, j: int, t: float) -> tuple[Array, Array, Array]:
    """Return h_i − h_j in m, its rate in m/s and its acceleration in m/s^2, at `t` s."""
    faster = np.subtract(place.rate_to(j, t + STEP), place.rate_to(j, t - STEP))
    return np.array(place.to(j, t)), np.array(place.rate_to(j, t)), faster / (2.0 * STEP)


def size(array: Array) -> float:
    """Return the length of a vector."""
    return float(np.linalg.norm(array))
