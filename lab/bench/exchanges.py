"""Two bodies of the tracker change names while the gateway restarts, in virtual time: where the two drones come down.

    python lab/bench/exchanges.py [--flights 4] [--first 10]

Four cases, with both swarms of the paper and both laws, in a fence of 4 m: the names change while the gateway is away,
with none, one or both of the two pilots restarting beside it; or before, so that nobody knows it any more. A row: the
drones, when the gateway restarts (s after the order to take off), how far the worst drone was outside the fence and how
near two came to one another from then on, m. Ends with status 1 if a drone of the extended law was outside the fence by
its margin or more, or nearer than 0.2 m to another.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Iterator
from itertools import combinations, product
from math import dist, inf
from pathlib import Path
from random import Random
from typing import Any

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import parse_swarm
from flockwire_core.process.fault_file import parse_faults
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_lab.process import Published
from flockwire_lab.world import World

SWARMS = Path(__file__).parents[2] / "examples"
NAMES, LAWS = ("paper_simulation", "paper_flight"), ("extended", "paper")
CASES = {"gateway": (0, False), "and a pilot": (1, False), "and both": (2, False), "both, before": (2, True)}
FENCE, COLLISION, AIR = 4.0, 0.2, 0.15  # m; a drone above AIR flies
DURATION, EARLIEST, LATEST = 12.0, 2.0, 7.0  # s from the order to take off
LASTS = 30.0  # s, to the end


def swarm_of(name: str, law: str) -> Swarm:
    """Return a swarm of the paper with `law` and without obstacles, in a small room."""
    table: dict[str, Any] = tomllib.loads((SWARMS / f"{name}.toml").read_text())
    table["control"]["law"] = law
    if name == "paper_simulation":
        table["control"]["rate_hz"] = 20
        table["leader"] |= {"trajectory": {"kind": "constant", "velocity": [0.1, 0.05, 0.0]}, "input_bound": 0.4}
    gateway = {"rate_hz": table["control"].get("rate_hz", 50), "noise": 0.002}
    table["gateway"] = table.get("gateway", {}) | gateway
    table["limits"]["fence"] = {"min": [-FENCE, -FENCE, -0.5], "max": [FENCE, FENCE, 3.0]}
    table.pop("obstacles", None)
    return parse_swarm(table, name)


def faults_of(plan: Plan, case: str, drones: list[int], at: float) -> list[dict[str, Any]]:
    """Return the exchange of `drones`, and who restarts."""
    restarted, before = CASES[case]
    changed = {"at": at + (-0.8 if before else 0.1), "kind": "swap", "drones": drones, "duration": LASTS}
    faults = [changed, {"at": at, "kind": "restart", "process": "gateway"}]
    for k, drone in enumerate(drones[:restarted]):
        faults.append({"at": at + 0.12 + 0.02 * k, "kind": "restart", "process": plan.pilots[drone]})
    return sorted(faults, key=lambda fault: float(fault["at"]))


class Watch:
    """How far the drones of `swarm` were outside the fence, and how near to one another from `at` (s) on, m."""

    def __init__(self, swarm: Swarm, at: float) -> None:
        self.outside, self.nearest = 0.0, inf
        self._room, self._at = swarm.limits.fence.room(), at
        self._began: int | None = None
        self._places: dict[str, Vector] = {}

    def take(self, published: Published) -> None:
        """Look at a message."""
        if published.key.kind not in ("truth", "mission"):
            return
        message: Any = published.message
        if isinstance(message, Mission):
            self._began = self._began or published.at
        elif isinstance(message, Pose):
            self._places[published.key.owner] = message.position
            self.outside = max(self.outside, self._room.outside(message.position))
            if self._began is not None and published.at - self._began > self._at * SECOND:
                flying = [place for place in self._places.values() if place[2] > AIR]
                self.nearest = min([self.nearest, *(dist(a, b) for a, b in combinations(flying, 2))])


def fly(name: str, law: str, case: str, seed: int) -> Watch:
    """Fly once and print a row."""
    chance, swarm = Random(f"{seed}"), swarm_of(name, law)
    plan, drones = Plan(swarm), chance.sample(list(swarm.flying), 2)
    at = round(chance.uniform(EARLIEST, LATEST), 3)
    watch = Watch(swarm, at)
    faults = parse_faults({"faults": faults_of(plan, case, drones, at)}, plan, "bench")
    outcome = World(swarm, seed, DURATION, faults, watch.take).run()
    row = f"{drones} at {at:5.2f}  outside {watch.outside:5.2f} m  nearest {watch.nearest:5.2f} m  {outcome.failure}"
    print(f"{name:17}{law:9}{case:13}{seed:4}  {row}", flush=True)
    return watch


def flown(flights: range) -> Iterator[tuple[str, Watch]]:
    """Fly all; yield each law with what it showed."""
    for name, law, case, seed in product(NAMES, LAWS, CASES, flights):
        yield law, fly(name, law, case, seed)


def main() -> int:
    """Fly all; returns 1 when one failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=4, help="of each case, swarm and law")
    parser.add_argument("--first", type=int, default=10)
    options = parser.parse_args()
    found = list(flown(range(options.first, options.first + options.flights)))
    for law in LAWS:
        seen = [watch for one, watch in found if one == law]
        left, near = sum(watch.outside > 0.0 for watch in seen), sum(watch.nearest < COLLISION for watch in seen)
        worst = max(watch.outside for watch in seen)
        outside = f"{left} of {len(seen)} outside the fence, by {worst:.2f} m at most"
        print(f"{law}: {outside}, {near} nearer than {COLLISION} m")
    margin = swarm_of(NAMES[0], "extended").limits.fence.margin
    return any(w.outside >= margin or w.nearest < COLLISION for law, w in found if law == "extended")


if __name__ == "__main__":
    sys.exit(main())
