"""Pre-flight checks besides the pilots' own: clocks, and drones away from their starts."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist

from flockwire_core.domain.order import Mission
from flockwire_core.ground.fleet import Fleet
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.wording import beside
from flockwire_core.wire.processes import RECORDER


def has_flown(mission: Mission | None) -> bool:
    """Return whether drones that obey `mission` may be away from their starts."""
    return mission is not None and mission.verb != "prepare"


def problems(swarm: Swarm, fleet: Fleet) -> tuple[str, ...]:
    """Return a sentence for each problem to correct before `fleet` takes off, which its recorder must not miss."""
    return (*fleet.waits(RECORDER.kind), *_clocks(swarm, fleet), *_places(swarm, fleet))


def _clocks(swarm: Swarm, fleet: Fleet) -> Iterator[str]:
    most = swarm.limits.clock_offset_bound
    for identity, bound in fleet.clocks_off(most).items():
        known = "not known" if bound < 0.0 else f"known to {1000 * bound:.0f} ms"
        yield f"{identity}: its clock's offset is {known}, limits.clock_offset_bound = {most:g} s"


def _places(swarm: Swarm, fleet: Fleet) -> Iterator[str]:
    """Name the drones that are not at their starts: the tracker may confuse them."""
    if has_flown(fleet.mission()):
        return
    starts, tolerance = {i: swarm.drone(i).start for i in swarm.flying}, swarm.limits.start_tolerance
    for drone, start in starts.items():
        place = fleet.fresh[drone].report.position if drone in fleet.fresh else None
        if place is None or (off := dist(place, start)) <= tolerance:
            continue
        nearest = min(starts, key=lambda i: dist(starts[i], place))
        other = f", the start of {uav(nearest)}" if nearest != drone else ""
        x, y, z = place
        yield (
            f"{uav(drone)}: its body is at [{x:.2f}, {y:.2f}, {z:.2f}]{other}, {beside(off, tolerance)} m from its "
            f"start, limits.start_tolerance = {tolerance:g} m"
        )
