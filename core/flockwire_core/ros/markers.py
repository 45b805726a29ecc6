"""The codec of visualization_msgs/MarkerArray, what RViz draws."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from flockwire_core.domain.quaternion import LEVEL
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.wire.cdr import Writer

Colour = tuple[float, float, float, float]  # red, green, blue, opacity, each 0 to 1


class Shape(IntEnum):
    """The shape of a marker, by its number in ROS."""

    ARROW = 0
    SPHERE = 2
    CYLINDER = 3
    LINE_LIST = 5
    TEXT = 9


class Marker(NamedTuple):
    """One thing to draw: `scale` is its size, m (of lines: x, their width; of text: z, its height)."""

    group: str  # RViz shows and hides whole groups
    number: int  # within the group
    shape: Shape
    colour: Colour
    scale: Vector
    position: Vector = ZERO
    points: tuple[Vector, ...] = ()
    text: str = ""


def marker_array(stamp: int, frame: str, markers: Sequence[Marker], lifetime: float) -> bytes:
    """Return a visualization_msgs/MarkerArray: each is drawn for `lifetime` s, unless it comes again."""
    writer = Writer()
    writer.length(len(markers))
    for marker in markers:
        writer.time(stamp)
        writer.text(frame)
        writer.text(marker.group)
        writer.put_all("i", marker.number, marker.shape, 0)  # added or changed
        writer.put_all("d", *marker.position, *LEVEL, *marker.scale)
        writer.put_all("f", *marker.colour)
        writer.put_all("i", int(lifetime), int(lifetime % 1.0 * 1e9))
        writer.byte(0)  # not locked to its frame
        writer.length(len(marker.points))
        if marker.points:
            writer.put_all("d", *(x for point in marker.points for x in point))
        writer.length(0)  # colours of points
        writer.text("")  # texture
        writer.time(0)
        for text in ("", ""):  # the texture's frame and format
            writer.text(text)
        for _ in range(2):  # the texture's data, and its coordinates
            writer.length(0)
        for text in (marker.text, "", ""):  # text, mesh, and the file of the mesh
            writer.text(text)
        writer.length(0)  # its data
        writer.byte(0)
    return writer.finish()
