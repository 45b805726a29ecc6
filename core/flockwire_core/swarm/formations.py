"""The formations of a swarm file, one model for each kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar, Literal, cast

from pydantic import Field, field_validator
from pydantic.json_schema import SkipJsonSchema

from flockwire_core.control import formation as shapes
from flockwire_core.control.key_frames import parse_key_frames
from flockwire_core.objects import load_object
from flockwire_core.swarm.tables import Finite, Model, Positive, key

PARAMETRIC = "flockwire_core.control.expression_formation:Parametric"  # which few swarms have


class FormationModel(Model):
    """The common part of all kinds."""

    places: Literal["assigned", "fixed"] = key("assigned", "assignment in a change to it: shortest paths, or by rank")
    assignment: Literal["rank", "free", "auction"] = key(
        "rank", "at a start: by rank, shortest paths, followers decide"
    )


class ShapeModel(FormationModel):
    """A formation whose other keys are the parameters of its `shape`."""

    shape: ClassVar[Callable[..., shapes.Formation]]

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return self.shape(count, **self.model_dump(exclude={"kind", "places", "assignment"}))


class CircleFormation(ShapeModel):
    """Followers evenly spread on a circle round the leader."""

    shape: ClassVar = shapes.Circle
    kind: Literal["circle"] = key(..., "evenly spread on a circle round the leader")
    radius: Positive = key(2.0, "of the circle", "m")
    rate: Finite = key(0.0, "clockwise from above", "rad/s")


class LineFormation(ShapeModel):
    """Followers on a line through the leader, alternately before and behind it."""

    shape: ClassVar = staticmethod(shapes.line)
    kind: Literal["line"] = key(..., "on a line through the leader")
    spacing: Positive = key(1.0, "between neighbours", "m")
    heading: Finite = key(0.0, "of the line, from X", "rad")
    rate: Finite = key(0.0, "about Z", "rad/s")


class GridFormation(ShapeModel):
    """Followers on a rectangular grid with the leader in one of its cells."""

    shape: ClassVar = staticmethod(shapes.grid)
    kind: Literal["grid"] = key(..., "on a rectangular grid")
    spacing: Positive = key(1.0, "between neighbours", "m")
    columns: int = key(3, "of the grid", ge=1)
    rate: Finite = key(0.0, "about Z", "rad/s")


class PolygonFormation(ShapeModel):
    """Followers evenly spread along the perimeter of a regular polygon round the leader."""

    shape: ClassVar = staticmethod(shapes.polygon)
    kind: Literal["polygon"] = key(..., "along the sides of a regular polygon")
    sides: int = key(4, "of the polygon", ge=3)
    radius: Positive = key(2.0, "of its corners", "m")
    rate: Finite = key(0.0, "about Z", "rad/s")


class KeyFramesFormation(FormationModel):
    """Offsets from a CSV file `t,drone,x,y,z`, joined by a smooth curve; `frames` is the file's text."""

    kind: Literal["key_frames"] = key(..., "by a CSV file `t,drone,x,y,z`")
    file: str = key(..., "its path, from the swarm file's folder")
    frames: SkipJsonSchema[str] = Field("", repr=False)

    def build(self, count: int) -> shapes.Formation:
        """Return the formation; the file must have a curve for each of the `count` followers."""
        formation = parse_key_frames(self.frames)
        if formation.count != count:
            raise ValueError(f"{self.file} has offsets for {formation.count} drones, the swarm has {count} followers")
        return formation


class ExpressionFormation(FormationModel):
    """Offsets in m as expressions in t (s), i (the follower's rank, from 0) and n (the number of followers)."""

    kind: Literal["expression"] = key(..., "by formulas")
    x: str = key(..., "in t, i and n", "m")
    y: str = key(..., "in t, i and n", "m")
    z: str = key("0", "in t, i and n", "m")

    @field_validator("x", "y", "z")
    @classmethod
    def _smooth(cls, text: str) -> str:
        load_object(PARAMETRIC)(1, (text,))
        return text

    def build(self, count: int) -> shapes.Formation:
        """Return the formation of `count` followers."""
        return cast("shapes.Formation", load_object(PARAMETRIC)(count, (self.x, self.y, self.z)))


FormationTable = Annotated[
    CircleFormation | LineFormation | GridFormation | PolygonFormation | KeyFramesFormation | ExpressionFormation,
    Field(discriminator="kind"),
]
