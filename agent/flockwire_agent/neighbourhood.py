"""What an agent hears from its in-neighbours, and which of it still counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flockwire.control.graph import LEADER
from flockwire.control.relay import LeaderMotion
from flockwire.control.vector import Vector
from flockwire.flight.phases import NEVER, age
from flockwire.law import Heard
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Estimate, Pose


@dataclass(slots=True)
class Neighbour:
    """One in-neighbour j: its weight w_ij and the newest that came from it."""

    weight: float
    stamp: int = 0
    motion: LeaderMotion | None = None  # its estimate of the leader
    position: Vector | None = None


class Neighbourhood:
    """The in-neighbours N_i of one follower."""

    def __init__(self, weights: dict[int, float], drop_after: float) -> None:
        self._neighbours = {j: Neighbour(weight) for j, weight in weights.items()}
        self._drop_after = round(drop_after * BILLION)  # ns
        self._heard = 0

    def hear_estimate(self, j: int) -> Callable[[Estimate], None]:
        """Return what takes neighbour j's estimates of the leader."""
        neighbour = self._neighbours[j]

        def hear(message: Estimate) -> None:
            stamp, _, position, velocity, acceleration = message
            neighbour.stamp = stamp
            neighbour.motion = LeaderMotion(position, velocity, acceleration)

        return hear

    def hear_pose(self, j: int) -> Callable[[Pose], None]:
        """Return what takes neighbour j's poses; the leader's is also its estimate of itself (eta_0 = x_0)."""
        neighbour = self._neighbours[j]

        def hear(message: Pose) -> None:
            neighbour.position = message.position
            if j == LEADER:
                neighbour.stamp, neighbour.motion = message.stamp, LeaderMotion(message.position)

        return hear

    def heard(self, now: int) -> list[Heard]:
        """Return what the neighbours that are fresh said of the leader; a stale one's weight leaves the sum."""
        oldest = now - self._drop_after
        fresh = [
            Heard(j, neighbour.weight, neighbour.stamp, neighbour.motion)
            for j, neighbour in self._neighbours.items()
            if neighbour.stamp >= oldest and neighbour.motion is not None
        ]
        if fresh:
            self._heard = now
        return fresh

    def silence(self, now: int, since: int) -> float:
        """Return for how long, s, no neighbour has been fresh; counted from `since` before the first was."""
        return age(max(self._heard, since), now)

    def oldest(self, now: int) -> float:
        """Return the age, s, of the neighbour that has been silent longest; NEVER when one was not heard yet."""
        return max((age(neighbour.stamp, now) for neighbour in self._neighbours.values()), default=NEVER)

    def missing(self, now: int) -> tuple[int, ...]:
        """Return the neighbours that are not fresh."""
        return tuple(j for j, neighbour in self._neighbours.items() if neighbour.stamp < now - self._drop_after)

    def positions(self) -> list[Vector]:
        """Return the neighbours' own positions, where they are known (m, world frame)."""
        return [neighbour.position for neighbour in self._neighbours.values() if neighbour.position is not None]
