"""Finds the drone of a tracker's body, by the name or number in the swarm file."""

from __future__ import annotations

from flockwire.swarm.model import Swarm


class Owners:
    """The drones of `swarm` by their bodies."""

    def __init__(self, swarm: Swarm) -> None:
        self._drones = {swarm.body(i): i for i in swarm.tracked}

    def drone(self, identity: int, name: str | None) -> int | None:
        """Return the drone of the body with this number and name, the name first; None for other bodies."""
        drone = self._drones.get(name) if name is not None else None
        return self._drones.get(identity) if drone is None else drone
