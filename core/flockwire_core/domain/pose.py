"""Position and orientation of a body; quaternions are plain tuples, as trackers report orientation."""

from __future__ import annotations

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
