"""Bodies near a drone: what they are, where they are nearest, and what must be kept from them."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from flockwire.domain.vector import Vector, norm, scale

_CONTACT = 1e-3  # m: a body that is touched counts as this far away, so that the direction survives


class BodyKind(IntEnum):
    """What a nearby body is."""

    DRONE = 0
    OBSTACLE = 1
    MOVER = 2  # moves and gives way to nobody: a person, a tracked obstacle


class Body(NamedTuple):
    """A nearby body: from the own position to its nearest axis point (m, world axes), and its radius (m) round that.

    The velocity (m/s, world frame) is a mover's, or that of the surface round a lost body; what drones do, each pilot
    sees for itself.
    """

    kind: BodyKind
    relative_position: Vector
    radius: float
    velocity: Vector = (0.0, 0.0, 0.0)


class Nearby(NamedTuple):
    """What a relative sensor on board sees at `stamp` (Unix ns), without identities."""

    stamp: int
    frame: str
    bodies: tuple[Body, ...]


class Separation(NamedTuple):
    """The distances to keep, m: between the centres of two drones, and from the surface of any other body."""

    drone: float
    obstacle: float

    def from_axis(self, body: Body) -> float:
        """Return the distance to keep from the axis of `body`, m."""
        return self.drone if body.kind is BodyKind.DRONE else self.obstacle + body.radius


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
