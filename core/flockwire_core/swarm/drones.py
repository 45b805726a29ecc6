"""The tables [[drones]], [airframes] and [wind] of a swarm file: every drone, responses of airframes, their wind.

The first two have common keys, and keys that rows of the airframe table add.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model

from flockwire_core.objects import load_object
from flockwire_core.swarm.airframes import AIRFRAMES, KINEMATICS
from flockwire_core.swarm.tables import Endpoint, Finite, Lag, Model, NotNegative, Point, Positive, key


class DroneKeys(Model):
    """One drone: it leads if `leaders` has its id, else it follows."""

    id: int = key(..., "followers of ascending ids take ascending places", ge=0, le=999)
    airframe: str = key(KINEMATICS.kind, "a name from [airframes]: a built-in one, or one of the file")
    start: Point = key(..., "its position before take-off, on the floor or on a table", "m")
    heading: Finite = key(0.0, "counter-clockwise from x, at its start, of a simulated airframe that turns", "rad")
    body: str | Annotated[int, Field(ge=0)] | None = key(None, "its name, or number, at the tracker; default: uavID")
    host: str | None = key(None, "the machine its agent runs on; default: the first of [hosts]")
    address: Endpoint | None = key(
        None, 'where its agent listens, "IP:PORT"; default: its host\'s address and a port of its own'
    )


class AirframeKeys(Model):
    """An airframe's response to a velocity command: dead time, then first-order lag. Laws know both."""

    kind: str = key(KINEMATICS.kind, "its row in the airframe table")
    gain: Positive = key(1.0, "speed over commanded speed, in steady state (simulated airframes)")
    lag: Lag = key(0.0, "time constant", "s")
    dead_time: Lag = key(0.0, "before it responds", "s")
    endurance: Positive = key(900.0, "of flight on a full battery (simulated airframes)", "s")


class Wind(Model):
    """The wind of simulated airframes; gusts differ from drone to drone."""

    velocity: Point = key((0.0, 0.0, 0.0), "its mean, world frame: by how much they drift at a zero command", "m/s")
    gust: NotNegative = key(0.0, "most by which it differs from that, horizontal", "m/s")


def _with_rows(common: type[Model], added: str, **fields: Any) -> Any:  # noqa: ANN401  (it makes a type)
    """Return the model `common` with the keys that the airframe table's column `added` adds."""
    own = [load_object(path) for row in AIRFRAMES if (path := getattr(row, added))]
    name = common.__name__.removesuffix("Keys")
    return create_model(name, __base__=(*own, common), __module__=__name__, __doc__=common.__doc__, **fields)


if TYPE_CHECKING:
    Drone = DroneKeys
    Airframe = AirframeKeys
else:
    Drone = _with_rows(DroneKeys, "drone_keys")
    kind = Literal[tuple(row.kind for row in AIRFRAMES)]
    Airframe = _with_rows(AirframeKeys, "airframe_keys", kind=(kind, AirframeKeys.model_fields["kind"]))


BUILT_IN_AIRFRAMES = {row.kind: Airframe(kind=row.kind, **row.built_in) for row in AIRFRAMES}
