"""A point on a trajectory, which nothing holds back: a virtual leader, or a simulated person who leads."""

from __future__ import annotations

from flockwire.control.trajectory import Trajectory
from flockwire.domain.order import Mission
from flockwire.domain.vector import Vector, add, subtract
from flockwire.pilot.orders import Orders
from flockwire.pilot.phases import FlightPhases


class MovingPoint:
    """Moves along `trajectory` from `position` (m) while the newest order is to start, and stands still otherwise.

    `born` is when it is there, Unix ns. An order to restart continues from where the point is, without a leap.
    """

    def __init__(self, trajectory: Trajectory, position: Vector, born: int) -> None:
        self.position = position
        self._trajectory = trajectory
        self._flight = FlightPhases(born)
        self._origin = position  # where the trajectory begins

    @property
    def orders(self) -> Orders:
        """The orders that it has taken in."""
        return self._flight.orders

    def order(self, mission: Mission, now: int) -> None:
        """Take an order at `now` (Unix ns)."""
        if not self._flight.order(mission, now):
            return
        t = self._flight.mission_time(now)
        if t is not None:
            self._origin = subtract(self.position, self._trajectory.position(t))

    def advance(self, now: int) -> Vector:
        """Move on to `now` (Unix ns); returns the position, m."""
        t = self._flight.mission_time(now)
        if t is not None:
            self.position = add(self._origin, self._trajectory.position(t))
        return self.position

    def moves(self, now: int) -> bool:
        """Return whether the trajectory has begun at `now` (Unix ns), and nothing has ended it."""
        return (self._flight.mission_time(now) or 0.0) > 0.0
