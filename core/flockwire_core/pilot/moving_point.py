"""A point on a trajectory: a virtual leader, or a simulated person who leads."""

from __future__ import annotations

from flockwire_core.control.trajectory import Trajectory
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add, subtract
from flockwire_core.pilot.orders import Orders


class MovingPoint:
    """Moves along `trajectory` from `position` (m) after a start order, and rests after any other.

    A later start order continues from the point's position, without a jump.
    """

    def __init__(self, trajectory: Trajectory, position: Vector) -> None:
        self.position = position
        self.orders = Orders()
        self._trajectory = trajectory
        self._origin = position  # start of the trajectory

    def order(self, mission: Mission, now: int) -> None:
        """Receive an order at `now` (Unix ns)."""
        was = self.orders.mission
        self.orders.take(mission, now)
        if self.orders.mission is was:
            return
        t = self._time(now)
        if t is not None:
            self._origin = subtract(self.position, self._trajectory.position(t))

    def advance(self, now: int) -> Vector:
        """Advance to `now` (Unix ns); returns the position, m."""
        t = self._time(now)
        if t is not None:
            self.position = add(self._origin, self._trajectory.position(t))
        return self.position

    def moves(self, now: int) -> bool:
        """Return whether the trajectory is in progress at `now` (Unix ns)."""
        return (self._time(now) or 0.0) > 0.0

    def _time(self, now: int) -> float | None:
        """Return the formation's time t in s at `now` (Unix ns), None without a start order."""
        mission = self.orders.mission
        return (now - mission.start) / SECOND if mission is not None and mission.in_formation else None
