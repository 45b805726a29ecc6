"""Pre-flight checks besides the pilots' own: clocks, and drones away from their starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import dist, inf
from typing import Self

from flockwire.domain.order import Mission
from flockwire.domain.vector import Vector
from flockwire.ground.fleet import Fleet
from flockwire.swarm.model import Swarm, uav


def has_flown(mission: Mission | None) -> bool:
    """Return whether drones that obey `mission` may be away from their starts."""
    return mission is not None and mission.verb != "prepare"


@dataclass(frozen=True, slots=True)
class Preflight:
    """The checks before the take-off order.

    Args:
        clock_bound: s, the most that a process's clock may be wrong by.
        starts: m, in the world frame, by drone.
        tolerance: m, between a drone that has not flown and its start.

    """

    clock_bound: float = inf
    starts: Mapping[int, Vector] = field(default_factory=dict)
    tolerance: float = inf

    @classmethod
    def of(cls, swarm: Swarm) -> Self:
        """Return the checks of a swarm file."""
        starts = {i: swarm.drone(i).start for i in swarm.flying}
        return cls(swarm.limits.clock_offset_bound, starts, swarm.limits.start_tolerance)

    def reasons(self, fleet: Fleet) -> tuple[str, ...]:
        """Return a sentence for each problem to correct first."""
        return (*self._clocks(fleet), *self._places(fleet))

    def _clocks(self, fleet: Fleet) -> Iterator[str]:
        for identity, bound in fleet.clocks_off(self.clock_bound).items():
            known = "not known" if bound < 0.0 else f"known to {1000 * bound:.0f} ms"
            yield f"{identity}: its clock's offset is {known}, limits.clock_offset_bound = {self.clock_bound:g} s"

    def _places(self, fleet: Fleet) -> Iterator[str]:
        """Name the drones that are not at their starts: the tracker may confuse them."""
        if has_flown(fleet.mission()):
            return
        for drone, start in self.starts.items():
            place = fleet.fresh[drone].report.position if drone in fleet.fresh else None
            if place is None or (beside := dist(place, start)) <= self.tolerance:
                continue
            nearest = min(self.starts, key=lambda i: dist(self.starts[i], place))
            other = f", the start of {uav(nearest)}" if nearest != drone else ""
            x, y, z = place
            yield (
                f"{uav(drone)}: its body is at [{x:.2f}, {y:.2f}, {z:.2f}]{other}, {beside:.2f} m from its start, "
                f"limits.start_tolerance = {self.tolerance:g} m"
            )
