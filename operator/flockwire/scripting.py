"""Flights by script: `open_swarm` flies a swarm from Python coroutines, in real or in virtual time.

A public interface (docs/python.md). Needs the extra `station`; a flight with a report needs `report` too. Times are s
of the flight, lengths m, world frame ENU.
"""

from flockwire_operator.scripting import DroneStatus, Flight, FlightError, open_swarm

__all__ = ["DroneStatus", "Flight", "FlightError", "open_swarm"]
