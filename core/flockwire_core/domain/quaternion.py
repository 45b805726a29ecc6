"""Unit quaternions as plain tuples (x, y, z, w), Hamilton's product: how trackers report orientation."""

from __future__ import annotations

from flockwire_core.domain.vector import Vector

Quaternion = tuple[float, float, float, float]  # x, y, z, w

LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)  # no rotation


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
