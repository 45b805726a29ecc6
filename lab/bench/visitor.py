"""A person with markers walks straight through a flying formation, in virtual time: how near drones come to the person.

    python lab/bench/visitor.py [SWARM] [--runs 100] [--seed 0] [--speed 1.0]

Each flight has another direction, moment, and distance from the middle. Printed: the smallest distance of any drone in
the air from the person's surface, m. Ends with status 1 if it was below the obstacles' safety distance.
"""

from __future__ import annotations

import argparse
import sys
from math import cos, hypot, inf, pi, sin
from pathlib import Path
from random import Random
from typing import Any

from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import load_swarm
from flockwire_core.process.fault_file import parse_faults
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_lab.process import Published
from flockwire_lab.world import World

WAY, DURATION = 5.0, 16.0  # m before and behind the formation's middle, s
EARLIEST, LATEST = 5.0, 7.0  # s after the order to take off at which the person sets out


class Watch:
    """The smallest distance of drones in the air from a person who leaves `start` at `at` s with `velocity` (m/s)."""

    def __init__(self, start: Vector, velocity: Vector, at: float, radius: float) -> None:
        self.nearest = inf
        self._start, self._velocity, self._at, self._radius = start, velocity, at, radius
        self._began = 0
        self._flying: set[str] = set()

    def take(self, published: Published) -> None:
        """Look at a message."""
        message: Any = published.message
        owner = published.key.owner
        if isinstance(message, Mission):
            self._began = self._began or published.at
        elif isinstance(message, Telemetry):
            (self._flying.add if message.state is FlightState.FLYING else self._flying.discard)(owner)
        elif isinstance(message, Pose) and published.key.kind == "truth" and owner in self._flying:
            t = (message.stamp - self._began) / SECOND - self._at
            if 0.0 <= t <= 2.0 * WAY / hypot(*self._velocity):
                x, y = (s + t * v for s, v in zip(self._start[:2], self._velocity[:2], strict=True))
                gap = hypot(message.position[0] - x, message.position[1] - y) - self._radius
                self.nearest = min(self.nearest, gap)


def fly(swarm: Swarm, seed: int, speed: float) -> bool:
    """Fly once and print a row; returns whether all went well."""
    chance, plan = Random(f"visitor {seed}"), Plan(swarm)
    at, heading = chance.uniform(EARLIEST, LATEST), chance.uniform(-pi, pi)
    aside = chance.uniform(-1.5, 1.5)  # m beside the middle
    c, s = cos(heading), sin(heading)
    middle = (at * 0.1 + 0.5, at * 0.1 + 0.5)
    start = (middle[0] - WAY * c - aside * s, middle[1] - WAY * s + aside * c, 1.2)
    velocity = (speed * c, speed * s, 0.0)
    fault = {"at": at, "kind": "visitor", "start": start, "velocity": velocity, "duration": 2.0 * WAY / speed}
    watch = Watch(start, velocity, at, swarm.gateway.person_radius)
    outcome = World(swarm, seed, DURATION, parse_faults({"faults": [fault]}, plan, "bench"), watch.take).run()
    well = watch.nearest >= swarm.avoidance.obstacle_safety_distance
    print(f"{seed:4}  nearest {watch.nearest:.3f} m  {'ok' if well else 'FAIL'}  {outcome.failure}", flush=True)
    return well


def main() -> None:
    """Fly all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("swarm", nargs="?", type=Path, default=Path("lab/bench/separation/five.toml"))
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--speed", type=float, default=1.0)
    options = parser.parse_args()
    swarm = load_swarm(options.swarm)
    results = [fly(swarm, options.seed + k, options.speed) for k in range(options.runs)]
    print(f"{sum(results)} of {len(results)}")
    sys.exit(not all(results))


if __name__ == "__main__":
    main()
