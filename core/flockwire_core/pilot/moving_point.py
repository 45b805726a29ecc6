"""A point on a trajectory: a virtual leader, or a simulated person who leads."""

from __future__ import annotations

from flockwire_core.control.trajectory import Trajectory
from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import Vector, add, subtract
from flockwire_core.pilot.orders import Orders
from flockwire_core.pilot.phases import FlightPhases


class MovingPoint:
    """Moves along `trajectory` from `position` (m) after a start order, and rests after any other.

    `born` is its first time, Unix ns. A later start order continues from the point's position, without a jump.
    """

    def __init__(self, trajectory: Trajectory, position: Vector, born: int) -> None:
        self.position = position
        self._trajectory = trajectory
        self._flight = FlightPhases(born)
        self._origin = position  # start of the trajectory

    @property
    def orders(self) -> Orders:
        """The received orders."""
        return self._flight.orders

    def order(self, mission: Mission, now: int) -> None:
        """Receive an order at `now` (Unix ns)."""
        if not self._flight.order(mission, now):
            return
        t = self._flight.mission_time(now)
        if t is not None:
            self._origin = subtract(self.position, self._trajectory.position(t))

    def advance(self, now: int) -> Vector:
        """Advance to `now` (Unix ns); returns the position, m."""
        t = self._flight.mission_time(now)
        if t is not None:
            self.position = add(self._origin, self._trajectory.position(t))
        return self.position

    def moves(self, now: int) -> bool:
        """Return whether the trajectory is in progress at `now` (Unix ns)."""
        return (self._flight.mission_time(now) or 0.0) > 0.0
