"""From the tracker's coordinates to the field's: up axis, unit, rotation and offset, once, at the gateway's input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flockwire.control.vector import ZERO, Vector, add

from flockwire_mocap.quaternion import IDENTITY, Quaternion, product, rotate
from flockwire_mocap.tracking import TrackerFrame

METRES = {"m": 1.0, "mm": 0.001}


@dataclass(frozen=True, slots=True)
class Coordinates:
    """How a tracker's coordinates map to the field's (ENU, metres).

    A point p of the tracker is R · s · A(p) + o on the field, and an orientation q is r ⊗ A(q), where A turns the
    tracker's up axis into z, s is its unit in metres, R the rotation `rotation` (the quaternion r) and o the `offset`.

    Attributes:
        up_axis: the tracker's axis that points up; "y" is turned so that (x, y, z) becomes (x, −z, y).
        unit: the tracker's unit of length.
        rotation: unit quaternion x, y, z, w: from the tracker's axes, z already up, to the field's.
        offset: m, where the tracker's origin lies on the field.

    """

    up_axis: Literal["y", "z"] = "z"
    unit: Literal["m", "mm"] = "m"
    rotation: Quaternion = IDENTITY
    offset: Vector = ZERO

    def position(self, point: Vector) -> Vector:
        """Return a tracker's point on the field, m."""
        x, y, z = point
        if self.up_axis == "y":
            y, z = -z, y
        metres = METRES[self.unit]
        return add(rotate(self.rotation, (x * metres, y * metres, z * metres)), self.offset)

    def orientation(self, q: Quaternion) -> Quaternion:
        """Return a tracker's orientation on the field: the vector part turns like a point, the angle stays."""
        x, y, z, w = q
        if self.up_axis == "y":
            y, z = -z, y
        return product(self.rotation, (x, y, z, w))

    def frame(self, frame: TrackerFrame) -> TrackerFrame:
        """Return the frame with the pose of every body on the field."""
        return frame._replace(
            bodies=tuple(
                body._replace(position=self.position(body.position), orientation=self.orientation(body.orientation))
                for body in frame.bodies
            )
        )
