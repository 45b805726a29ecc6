"""The formations of a swarm file, one model for each kind."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from flockwire.control import formation as shapes
from flockwire.control.key_frames import parse_key_frames
from flockwire.swarm.tables import Finite, Model, Positive


class CircleFormation(Model):
    """Followers evenly spread on a circle round the leader."""

    kind: Literal["circle"]
    radius: Positive = 2.0
    rate: Finite = 0.0  # rad/s about Z

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Circle(count, self.radius, self.rate)


class LineFormation(Model):
    """Followers on a line through the leader, alternately before and behind it."""

    kind: Literal["line"]
    spacing: Positive = 1.0
    heading: Finite = 0.0
    rate: Finite = 0.0

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Line(count, self.spacing, self.heading, self.rate)


class GridFormation(Model):
    """Followers on a rectangular grid with the leader in one of its cells."""

    kind: Literal["grid"]
    spacing: Positive = 1.0
    columns: Annotated[int, Field(ge=1)] = 3
    rate: Finite = 0.0

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Grid(count, self.spacing, self.columns, self.rate)


class PolygonFormation(Model):
    """Followers evenly spread along the perimeter of a regular polygon round the leader."""

    kind: Literal["polygon"]
    sides: Annotated[int, Field(ge=3)] = 4
    radius: Positive = 2.0
    rate: Finite = 0.0

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return shapes.Polygon(count, self.sides, self.radius, self.rate)


class KeyFramesFormation(Model):
    """Offsets from a CSV file `t,drone,x,y,z`, joined by a smooth curve; `frames` holds its text once it is read."""

    kind: Literal["key_frames"]
    file: str
    frames: str = ""

    def build(self, count: int) -> shapes.Formation:
        """Return the formation; the file must have a curve for each of the `count` followers."""
        formation = parse_key_frames(self.frames)
        if formation.count != count:
            raise ValueError(f"{self.file} has offsets for {formation.count} drones, the swarm has {count} followers")
        return formation


FormationTable = Annotated[
    CircleFormation | LineFormation | GridFormation | PolygonFormation | KeyFramesFormation,
    Field(discriminator="kind"),
]
