"""Makes the vehicle of figures."""

from __future__ import annotations

from flockwire_twins.multirotor.fitted import FittedVehicle
from flockwire_twins.multirotor.parameters import Parameters
from flockwire_twins.multirotor.rotors import RotorVehicle
from flockwire_twins.multirotor.vehicle import Vehicle


def make_vehicle(p: Parameters) -> Vehicle:
    """Return a vehicle: by the fitted model if it has one."""
    if p.fitted is not None:
        return FittedVehicle(p, p.fitted)
    if p.rotors is not None:
        return RotorVehicle(p, p.rotors)
    raise ValueError("neither a fitted model nor rotors")
