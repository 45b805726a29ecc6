"""Bodies near a drone: kinds, nearest points, safety distances."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import hypot
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Frozen, Record
from flockwire_core.domain.vector import ZERO, Vector, norm, scale

AT_REST: Final = 0.1  # m/s, the speed of a person who stands, with the tracker's noise


class BodyKind(IntEnum):
    """The kind of a nearby body."""

    DRONE = 0
    OBSTACLE = 1
    MOVER = 2  # moves and does not give way: a person, a tracked obstacle


@mypyc_attr(acyclic=True)
class Body(Record):
    """A nearby body: from the own position to its nearest axis point (m, world axes), and its radius (m) round that.

    The velocity (m/s, world frame) is a mover's, or that of the surface around a lost body; that of a drone is zero in
    a message, and tracked on board.
    """

    __slots__ = ("kind", "relative_position", "radius", "velocity")

    def __init__(self, kind: BodyKind, relative_position: Vector, radius: float, velocity: Vector = ZERO) -> None:
        self.kind: Final = kind
        self.relative_position: Final = relative_position
        self.radius: Final = radius
        self.velocity: Final = velocity


def stands(body: Body) -> bool:
    """Return whether `body` is an obstacle, or another body at rest that is not a drone."""
    if body.kind is BodyKind.OBSTACLE:
        return True
    return body.kind is BodyKind.MOVER and hypot(body.velocity[0], body.velocity[1]) < AT_REST


@mypyc_attr(acyclic=True)
class Nearby(Record):
    """The bodies seen by a relative sensor on board at `stamp` (Unix ns), without identities."""

    __slots__ = ("stamp", "frame", "bodies")

    def __init__(self, stamp: int, frame: str, bodies: tuple[Body, ...]) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.bodies: Final = bodies


@dataclass(frozen=True, slots=True)
class Separation(Frozen):
    """The distances to keep, m: between the centres of two drones, and from the surface of any other body."""

    drone: float
    obstacle: float

    def from_axis(self, body: Body) -> float:
        """Return the safety distance from the axis of `body`, m."""
        return self.drone if body.kind is BodyKind.DRONE else self.obstacle + body.radius


def to_axis(position: Vector, center: Vector, height: float | None) -> Vector:
    """Return the vector from `position` to the nearest point of an upright cylinder's axis, m.

    The axis starts on the ground (z = 0) and ends at `height` m; without a height it is endless.
    """
    z = position[2] if height is None else min(position[2], height)
    return (center[0] - position[0], center[1] - position[1], z - position[2])


def to_surface(relative: Vector, radius: float) -> Vector:
    """Shorten `relative` (m, from us to a body's axis) by the body's `radius` m: from us to its surface."""
    distance = norm(relative)
    if distance == 0.0:
        return relative
    # m: a touched body counts as this far away, so that a direction exists
    return scale(relative, max(distance - radius, 1e-3) / distance)
