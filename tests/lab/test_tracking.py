"""What the gateway's source guarantees in flight: nobody waits for a dead driver, faults survive a restart."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.world import EPOCH, World

FRAME = 0.01  # s
DRONES = range(5)


class Flight:
    """A virtual flight of which the poses are kept, by owner, with s since its beginning."""

    def __init__(self, swarm: Swarm, *faults: dict[str, Any], duration: float = 7.0) -> None:
        self.poses: dict[str, list[float]] = {uav(i): [] for i in DRONES}
        self.world = World(swarm, 1, duration, parse_faults({"faults": list(faults)}, Plan(swarm), "test"), self._take)

    def _take(self, published: Published) -> None:
        if published.key.kind == "pose":
            self.poses[published.key.owner].append((published.at - EPOCH) / SECOND)

    def end_truth(self, drone: int, at: float) -> None:
        """Let the truth of a drone arrive nowhere from `at` (s) on, as when its driver dies."""
        outlet = self.world.processes["kinematics"].outlets[Key("truth", uav(drone))]
        self.world.scheduler.at(EPOCH + nanoseconds(at), lambda _: outlet.readers.clear())

    def between(self, drone: int, begin: float, end: float) -> list[float]:
        """Return when the poses of a drone were published, of those between two moments (s)."""
        return [t for t in self.poses[uav(drone)] if begin <= t < end]


@pytest.mark.parametrize("dead", [1, 4])
def test_a_dead_driver_slows_no_other_poses(make_swarm: Callable[..., Swarm], dead: int) -> None:
    flight = Flight(make_swarm())
    flight.end_truth(dead, 4.0)
    flight.world.run()
    assert not flight.between(dead, 4.0 + FRAME, 99.0)
    for i in set(DRONES) - {dead}:
        assert max(b - a for a, b in pairwise(flight.between(i, 3.5, 6.0))) < 2.5 * FRAME
        later = flight.between(i, 4.0 + 4 * FRAME, 6.0)
        assert all(b - a == pytest.approx(FRAME, abs=1e-6) for a, b in pairwise(later))


@pytest.mark.parametrize("restart", [True, False])
def test_a_fault_of_the_tracker_happens_after_the_gateways_restart_too(
    make_swarm: Callable[..., Swarm], restart: bool
) -> None:
    loss = {"at": 5.0, "kind": "tracker", "drone": 2, "duration": 0.4}
    again = {"at": 3.0, "kind": "restart", "process": "gateway"}
    flight = Flight(make_swarm(), *([again] if restart else []), loss)
    outcome = flight.world.run()
    took_off = flight.world.director.took_off
    assert outcome.failure == ""
    assert took_off is not None
    begin = (took_off - EPOCH) / SECOND
    assert (not flight.between(2, begin + 3.01, begin + 3.49)) == restart
    for i in DRONES:
        poses = len(flight.between(i, begin + 5.0 + FRAME, begin + 5.4))
        assert poses == 0 if i == 2 else poses >= 38
    assert len(flight.between(2, begin + 5.4 + FRAME, begin + 5.8)) >= 38
