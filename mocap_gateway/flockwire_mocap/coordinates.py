"""Converts the tracker's coordinates to the field's: up axis, unit, rotation and offset."""

from __future__ import annotations

from dataclasses import dataclass

from flockwire_core.domain.pose import LEVEL, Quaternion, product, rotate
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from flockwire_core.swarm.gateway import Gateway, Unit, UpAxis

from flockwire_mocap.tracking import ReportedBody

METRES = {"m": 1.0, "mm": 0.001}


@dataclass(frozen=True, slots=True)
class Coordinates:
    """The map from a tracker's coordinates to the field's (ENU, metres).

    A point p of the tracker is R · s · A(p) + o on the field, and an orientation q is r ⊗ A(q), where A turns the
    tracker's up axis into z, s is its unit in metres, R the rotation `rotation` (the quaternion r) and o the `offset`.

    Attributes:
        up_axis: the tracker's axis that points up; "y" is turned so that (x, y, z) becomes (x, −z, y).
        unit: the tracker's unit of length.
        rotation: unit quaternion x, y, z, w: from the tracker's axes, with z up, to the field's.
        offset: m, of the tracker's origin on the field.

    """

    up_axis: UpAxis = "z"
    unit: Unit = "m"
    rotation: Quaternion = LEVEL
    offset: Vector = ZERO

    def position(self, point: Vector) -> Vector:
        """Return a tracker's point on the field, m."""
        x, y, z = point
        if self.up_axis == "y":
            y, z = -z, y
        metres = METRES[self.unit]
        return add(rotate(self.rotation, (x * metres, y * metres, z * metres)), self.offset)

    def orientation(self, q: Quaternion) -> Quaternion:
        """Return a tracker's orientation on the field: the vector part rotates like a point, the angle is unchanged."""
        x, y, z, w = q
        if self.up_axis == "y":
            y, z = -z, y
        return product(self.rotation, (x, y, z, w))

    def body(self, body: ReportedBody) -> ReportedBody:
        """Return the body with its pose on the field."""
        place, orientation = self.position(body.position), self.orientation(body.orientation)
        return ReportedBody(body.identity, body.name, place, orientation, body.tracked)

    def to_tracker(self, body: ReportedBody) -> ReportedBody:
        """Return a body on the field in the tracker's frame: the inverse of `body`."""
        back: Quaternion = (-self.rotation[0], -self.rotation[1], -self.rotation[2], self.rotation[3])
        x, y, z = rotate(back, subtract(body.position, self.offset))
        qx, qy, qz, qw = product(back, body.orientation)
        if self.up_axis == "y":
            y, z, qy, qz = z, -y, qz, -qy
        per_metre = 1.0 / METRES[self.unit]
        return body._replace(position=(x * per_metre, y * per_metre, z * per_metre), orientation=(qx, qy, qz, qw))


def coordinates_of(gateway: Gateway) -> Coordinates:
    """Return the map from the frame of the tracker in `gateway` to the field."""
    table = gateway.table
    return Coordinates(table.up_axis, table.unit, gateway.rotation, gateway.offset)
