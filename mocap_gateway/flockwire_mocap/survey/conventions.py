"""The unit and the up axis of a tracker, from drones at their starts: its settings may say what it does not send."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import dist
from typing import get_args

from flockwire.domain.quaternion import IDENTITY
from flockwire.domain.vector import Vector
from flockwire.swarm.gateway import Gateway, Unit, UpAxis

from flockwire_mocap.coordinates import Coordinates
from flockwire_mocap.streamed import coordinates_of
from flockwire_mocap.tracking import ReportedBody

NEARER = 0.2  # times the present distance from the starts: what other settings must reach to be suggested
OTHER = (
    "all drones are {far:.2f} m from their starts on average, with unit = {unit!r} and up_axis = {up_axis!r} "
    "in [gateway.{source}] it were {near:.2f} m"
)


def other_conventions(gateway: Gateway, places: Sequence[tuple[Vector, Vector]], tolerance: float) -> str:
    """Return which unit and up axis bring all drones near their starts; empty if one is within `tolerance` (m) now.

    `places` are where each drone is seen and where it starts, m on the field.
    """
    if not places or min(dist(*pair) for pair in places) <= tolerance:
        return ""
    read = coordinates_of(gateway)
    points = [
        (read.to_tracker(ReportedBody(0, None, seen, IDENTITY, tracked=True)).position, start) for seen, start in places
    ]

    def average(frame: Coordinates) -> float:
        return sum(dist(frame.position(point), start) for point, start in points) / len(points)

    frames = [replace(read, unit=unit, up_axis=axis) for unit in get_args(Unit) for axis in get_args(UpAxis)]
    best, far = min(frames, key=average), average(read)
    if average(best) > NEARER * far:
        return ""
    return OTHER.format(far=far, near=average(best), unit=best.unit, up_axis=best.up_axis, source=gateway.source)
