"""Two bodies of the tracker change names at random moments of virtual flights: whether both pilots hold in time.

    python lab/bench/swaps.py [SWARM] [--runs 50] [--seed 0]

For each flight: the drones, the moment (s after the order to take off), how long after it both pilots held, ms, the
smallest distance between two drones from then on, m. Ends with status 1 if a pilot took more than 100 ms, or two drones
came closer than 0.2 m.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from itertools import combinations
from math import dist, inf
from pathlib import Path
from random import Random
from typing import Any

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import load_swarm
from flockwire_core.process.fault_file import parse_faults
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_lab.process import Published
from flockwire_lab.world import World

HOLD_WITHIN, COLLISION = 0.1, 0.2  # s, m
EARLIEST, LATEST, DURATION = 4.0, 12.0, 16.0  # s


class Watch:
    """What one flight shows of a swap of `drones` at `at` s after the order to take off."""

    def __init__(self, plan: Plan, drones: tuple[int, int], at: float) -> None:
        self.held: dict[int, float] = {}
        self.nearest = inf
        self._pilots, self._at = {i: plan.pilot[i] for i in drones}, at
        self._began = 0
        self._truths: dict[str, tuple[int, Vector]] = {}
        self.phase: Callable[[str], object] = lambda _: None

    def take(self, published: Published) -> None:
        """Look at a message, and at the pilots."""
        message: Any = published.message
        if isinstance(message, Mission):
            self._began = self._began or published.at
        elif isinstance(message, Pose) and published.key.kind == "truth":
            self._truths[published.key.owner] = (message.stamp, message.position)
        elapsed = (published.at - self._began) / SECOND - self._at
        if not self._began or elapsed <= 0.0:
            return
        for drone, pilot in self._pilots.items():
            if drone not in self.held and self.phase(pilot) is Phase.HOLD:
                self.held[drone] = elapsed
        if published.key.kind == "truth" and len(self._truths) > 1:
            places = [place for _, place in self._truths.values() if place[2] > COLLISION]
            self.nearest = min([self.nearest, *(dist(a, b) for a, b in combinations(places, 2))])


def fly(swarm: Swarm, seed: int) -> bool:
    """Fly once and print a row; returns whether all went well."""
    chance, plan = Random(f"swap {seed}"), Plan(swarm)
    one, other = chance.sample(swarm.flying, 2)
    at = round(chance.uniform(EARLIEST, LATEST), 3)
    fault = {"at": at, "kind": "swap", "drones": [one, other], "duration": DURATION}
    watch = Watch(plan, (one, other), at)
    world = World(swarm, seed, DURATION, parse_faults({"faults": [fault]}, plan, "bench"), watch.take)
    watch.phase = lambda pilot: world.processes[pilot]._core._pilot.flight.phase
    world.run()
    slowest = max(watch.held.values()) if len(watch.held) == 2 else inf
    well = slowest <= HOLD_WITHIN and watch.nearest > COLLISION
    print(
        f"{seed:4}  {uav(one)} and {uav(other)} at {at:6.3f}  held {1000 * slowest:6.1f} ms  "
        f"nearest {watch.nearest:.3f} m  {'ok' if well else 'FAIL'}",
        flush=True,
    )
    return well


def main() -> None:
    """Fly all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("swarm", nargs="?", type=Path, default=Path("examples/paper_simulation.toml"))
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    swarm = load_swarm(options.swarm)
    results = [fly(swarm, options.seed + k) for k in range(options.runs)]
    print(f"{sum(results)} of {len(results)}")
    sys.exit(not all(results))


if __name__ == "__main__":
    main()
