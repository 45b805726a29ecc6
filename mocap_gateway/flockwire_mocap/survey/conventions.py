"""The unit and the up axis of a tracker, from drones at their starts: its settings may say what it does not send."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import dist
from typing import get_args

from flockwire_core.domain.quaternion import IDENTITY
from flockwire_core.domain.vector import Vector
from flockwire_core.swarm.gateway import Gateway, Unit, UpAxis

from flockwire_mocap.coordinates import Coordinates
from flockwire_mocap.streamed import coordinates_of
from flockwire_mocap.tracking import ReportedBody

BETTER = 0.2  # times the present distance from the starts, and
NEAR = 3.0  # times the tolerance: how near other settings must bring every drone to be suggested
OTHER = (
    "a drone is {far:.2f} m from its start; with unit = {unit!r} and up_axis = {up_axis!r} in [gateway.{source}] "
    "all would be within {near:.2f} m of theirs"
)


def other_conventions(gateway: Gateway, places: Sequence[tuple[Vector, Vector]], tolerance: float) -> str:
    """Return which unit and up axis bring all drones near their starts; empty if all are within `tolerance` (m) now.

    `places` are where each drone is seen and where it starts, m on the field.
    """
    read = coordinates_of(gateway)
    points = [
        (read.to_tracker(ReportedBody(0, None, seen, IDENTITY, tracked=True)).position, start) for seen, start in places
    ]

    def farthest(frame: Coordinates) -> float:
        return max((dist(frame.position(point), start) for point, start in points), default=0.0)

    frames = [replace(read, unit=unit, up_axis=axis) for unit in get_args(Unit) for axis in get_args(UpAxis)]
    best = min(frames, key=farthest)
    far, near = farthest(read), farthest(best)
    if far <= tolerance or near > min(BETTER * far, NEAR * tolerance):
        return ""
    return OTHER.format(far=far, near=near, unit=best.unit, up_axis=best.up_axis, source=gateway.source)
