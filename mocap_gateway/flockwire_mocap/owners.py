"""Whose body is whose: a tracker knows a drone by the name or by the number that the swarm file gives its body."""

from __future__ import annotations

from flockwire.swarm.model import Swarm


class Owners:
    """The drones of `swarm` by their bodies."""

    def __init__(self, swarm: Swarm) -> None:
        self._drones = {swarm.body(i): i for i in swarm.tracked}

    def drone(self, identity: int, name: str | None) -> int | None:
        """Return whose the body with this number and name is, the name first; None when it is no drone's."""
        drone = self._drones.get(name) if name is not None else None
        return self._drones.get(identity) if drone is None else drone
