"""Position and orientation of a body."""

from __future__ import annotations

from math import atan2, pi
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.quaternion import LEVEL, Quaternion
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector


@mypyc_attr(acyclic=True)
class Pose(Record):
    """The pose of a body at `stamp` (Unix ns): m, in the world frame `frame`."""

    __slots__ = ("stamp", "frame", "position", "orientation")

    def __init__(self, stamp: int, frame: str, position: Vector, orientation: Quaternion = LEVEL) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.position: Final = position
        self.orientation: Final = orientation


def yaw_of(orientation: Quaternion) -> float:
    """Return the heading of a body's forward axis, seen from above: rad, counter-clockwise from world x.

    yaw = atan2(2 (w z + x y), 1 − 2 (y² + z²))        (of a unit quaternion)
    """
    x, y, z, w = orientation
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def wrapped(angle: float) -> float:
    """Return an angle between −pi and pi."""
    return (angle + pi) % (2.0 * pi) - pi
