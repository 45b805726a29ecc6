"""Position and orientation of a body."""

from __future__ import annotations

from math import atan2, pi
from typing import NamedTuple

from flockwire.domain.quaternion import Quaternion
from flockwire.domain.vector import Vector

LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """The pose of a body at `stamp` (Unix ns): m, in the world frame `frame`."""

    stamp: int
    frame: str
    position: Vector
    orientation: Quaternion = LEVEL


class IdentityDoubt(NamedTuple):
    """The tracker has given the drone's name to another body since `since` (Unix ns)."""

    stamp: int
    frame: str
    since: int


def yaw_of(orientation: Quaternion) -> float:
    """Return the heading of a body's forward axis, seen from above: rad, counter-clockwise from world x.

    yaw = atan2(2 (w z + x y), 1 − 2 (y² + z²))        (of a unit quaternion)
    """
    x, y, z, w = orientation
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def wrapped(angle: float) -> float:
    """Return an angle between −pi and pi."""
    return (angle + pi) % (2.0 * pi) - pi
