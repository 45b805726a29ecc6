"""Flights by script: `open_swarm` flies a swarm from Python coroutines, in real or in virtual time."""

from flockwire_operator.scripting.flight import DroneStatus, Flight, FlightError
from flockwire_operator.scripting.opening import open_swarm

__all__ = ["DroneStatus", "Flight", "FlightError", "open_swarm"]
