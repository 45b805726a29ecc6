"""The heading of a body that turns about the vertical axis.

yaw = atan2(2 (w z + x y), 1 − 2 (y² + z²))        (of a unit quaternion x, y, z, w)
"""

from __future__ import annotations

from math import atan2, pi

Quaternion = tuple[float, float, float, float]


def yaw_of(orientation: Quaternion) -> float:
    """Return the heading of a body's forward axis, seen from above: rad, counter-clockwise from world x."""
    x, y, z, w = orientation
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def wrapped(angle: float) -> float:
    """Return an angle between −pi and pi."""
    return (angle + pi) % (2.0 * pi) - pi
