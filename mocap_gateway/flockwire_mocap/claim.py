"""A body that has a drone's name at the tracker."""

from __future__ import annotations

from collections.abc import Mapping
from operator import attrgetter
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.quaternion import Quaternion
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector

in_order: Final = attrgetter("stamp", "drone")  # the key by which claims are sorted


@mypyc_attr(acyclic=True)
class Claim(Record):
    """A body with a drone's name at the tracker, as seen at `stamp` (ns): m, orientation x y z w."""

    __slots__ = ("stamp", "drone", "position", "orientation")

    def __init__(self, stamp: int, drone: int, position: Vector, orientation: Quaternion) -> None:
        self.stamp: Final = stamp
        self.drone: Final = drone
        self.position: Final = position
        self.orientation: Final = orientation


def owner(drones: Mapping[str | int, int], identity: int, name: str | None) -> int | None:
    """Return whose of `drones` (by body) the body with this number and name is, the name first; None: no drone's."""
    drone = drones.get(name) if name is not None else None
    return drones.get(identity) if drone is None else drone
