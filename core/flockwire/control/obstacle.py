"""Where an obstacle is nearest: the separation that potentials and clearances are measured along."""

from flockwire.control.vector import Vector, norm, scale

_CONTACT = 1e-3
"""Metres: a body that is touched counts as this far away, so that the direction survives."""


def to_axis(position: Vector, center: Vector, height: float | None) -> Vector:
    """Return the vector from `position` to the nearest point of an upright cylinder's axis, m.

    The axis stands on the ground (z = 0) and ends at `height` m; without a height it is endless.
    """
    z = position[2] if height is None else min(position[2], height)
    return (center[0] - position[0], center[1] - position[1], z - position[2])


def to_surface(relative: Vector, radius: float) -> Vector:
    """Shorten `relative` (m, from us to a body's axis) by the body's `radius` m: from us to its surface."""
    distance = norm(relative)
    if distance == 0.0:
        return relative
    return scale(relative, max(distance - radius, _CONTACT) / distance)
