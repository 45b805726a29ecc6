"""Rotation matrices as QTM sends them, nine numbers column by column; from and to quaternions x, y, z, w, to angles."""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2, degrees, hypot

from flockwire_core.domain.pose import Quaternion, rotate


def to_columns(q: Quaternion) -> tuple[float, ...]:
    """Return the matrix of the unit quaternion `q`: the rotated axes, column by column."""
    return (*rotate(q, (1.0, 0.0, 0.0)), *rotate(q, (0.0, 1.0, 0.0)), *rotate(q, (0.0, 0.0, 1.0)))


def to_angles(columns: Sequence[float]) -> tuple[float, float, float]:
    """Return QTM's usual angles of a rotation matrix, degrees: R = Rx(a) Ry(b) Rz(c), b from -90 to 90.

    At b = ±90 only the sum or the difference of a and c is defined: then c = 0.
    """
    ux, _, _, vx, vy, vz, wx, wy, wz = columns
    b = degrees(asin(max(-1.0, min(1.0, wx))))
    if hypot(wy, wz) < 1e-6:  # below this cosine of b, a and c cannot be distinguished
        return degrees(atan2(vz, vy)), b, 0.0
    return degrees(atan2(-wy, wz)), b, degrees(atan2(-vx, ux))


def from_columns(columns: Sequence[float]) -> Quaternion:
    """Return the unit quaternion of a rotation matrix; all zeros if it is none.

        4 w² = 1 + trace,   4 x² = 1 + R11 − R22 − R33,  …;   4 w x = R32 − R23,   4 x y = R12 + R21,  …

    All are divided by the largest of the four, never by a small number (S. Shepperd, 1978).
    """
    a, b, c, d, e, f, g, h, i = columns
    candidates = (
        (f - h, g - c, b - d, 1.0 + a + e + i),
        (1.0 + a - e - i, b + d, c + g, f - h),
        (b + d, 1.0 - a + e - i, f + h, g - c),
        (c + g, f + h, 1.0 - a - e + i, b - d),
    )
    x, y, z, w = max(candidates, key=lambda q: hypot(*q))
    length = hypot(x, y, z, w)
    return (x / length, y / length, z / length, w / length) if length > 0.0 else (0.0, 0.0, 0.0, 0.0)
