"""Position and orientation of a body; unit quaternions are plain tuples, as trackers report them (Hamilton)."""

from __future__ import annotations

from math import atan2, pi
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector

Quaternion = tuple[float, float, float, float]  # x, y, z, w, of a unit quaternion

LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)  # no rotation


@mypyc_attr(acyclic=True)
class Pose(Record):
    """The pose of a body at `stamp` (Unix ns): m, in the world frame `frame`."""

    __slots__ = ("stamp", "frame", "position", "orientation")

    def __init__(self, stamp: int, frame: str, position: Vector, orientation: Quaternion = LEVEL) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.position: Final = position
        self.orientation: Final = orientation


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return a ⊗ b: the rotation b, then the rotation a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return q v q*: `v`, rotated by the unit quaternion `q`; v + 2 u × (u × v + w v) with q = (u, w)."""
    x, y, z, w = q
    a = y * v[2] - z * v[1] + w * v[0]
    b = z * v[0] - x * v[2] + w * v[1]
    c = x * v[1] - y * v[0] + w * v[2]
    return (v[0] + 2.0 * (y * c - z * b), v[1] + 2.0 * (z * a - x * c), v[2] + 2.0 * (x * b - y * a))


def conjugate(q: Quaternion) -> Quaternion:
    """Return q*, for a unit quaternion the inverse rotation."""
    x, y, z, w = q
    return (-x, -y, -z, w)


def yaw_of(orientation: Quaternion) -> float:
    """Return the heading of a body's forward axis, seen from above: rad, counter-clockwise from world x.

    yaw = atan2(2 (w z + x y), 1 − 2 (y² + z²))        (of a unit quaternion)
    """
    x, y, z, w = orientation
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def wrapped(angle: float) -> float:
    """Return an angle between −pi and pi."""
    return (angle + pi) % (2.0 * pi) - pi
