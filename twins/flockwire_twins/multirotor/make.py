"""From the keys of an airframe: the figures of a model, or of a user's file, and the vehicle that has them."""

from __future__ import annotations

import tomllib
from functools import cache
from typing import TYPE_CHECKING

from flockwire_core.swarm.validation import validate

from flockwire_twins.multirotor.fitted import FittedVehicle
from flockwire_twins.multirotor.parameters import Parameters
from flockwire_twins.multirotor.rotors import RotorVehicle
from flockwire_twins.multirotor.swarm_file import MODELS, MultirotorInAirframes
from flockwire_twins.multirotor.vehicle import Vehicle

if TYPE_CHECKING:
    from flockwire_core.swarm.drones import AirframeKeys


class ParametersError(ValueError):
    """A file of parameters that cannot be flown."""


@cache
def _read(name: str, text: str | None) -> Parameters:
    try:
        table = MODELS[name] if text is None else tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ParametersError(f"{name}: not TOML: {error}") from None
    return validate(Parameters, table, name, ParametersError)


def parameters_of(airframe: AirframeKeys) -> Parameters:
    """Return the figures of an airframe; raises ParametersError with a line for each problem of its file."""
    if not isinstance(airframe, MultirotorInAirframes):
        raise TypeError(f"{airframe!r} has no keys of a multirotor")
    file = airframe.file
    found = _read(airframe.model, None) if file is None else _read(file, airframe.frames)
    return found if found.fitted and not airframe.rotors else found.model_copy(update={"fitted": None})


def make_vehicle(p: Parameters) -> Vehicle:
    """Return a vehicle: by the fitted model if it has one."""
    if p.fitted is not None:
        return FittedVehicle(p, p.fitted)
    if p.rotors is not None:
        return RotorVehicle(p, p.rotors)
    raise ValueError("neither a fitted model nor rotors")
