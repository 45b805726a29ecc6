"""How quickly drones come into formation from random starts, and what keeps them: a table.

    python lab/bench/settling.py [--flights 10] [--followers 8] [--airframe tello] [--jobs 2]

Each flight: followers start at random in 7 x 7 m, hold after take-off, and fly to a grid behind a leader at 0.2 m/s.
They have settled when the last of them is within 0.1 m of its place for good. `allowed` is what distance and speed
allow: the longest way to a place, which moves on meanwhile, at limits.speed; `standing` takes the places as they are at
the formation's time 0. Three ways of the same starts:

    by rank      each has the place of its rank
    free         assignment = "free": the operator's assignment for the shortest ways
    by rank, alone   as by rank, with a safety distance of 1 cm: nobody is in another's way

So `by rank` less `by rank, alone` is what others cost, and `alone` less `allowed` what law and airframe cost.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from math import dist
from random import Random
from statistics import median
from typing import Any, NamedTuple

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add, scale
from flockwire_core.loading import parse_swarm
from flockwire_core.pilot.orders import flown_formation
from flockwire_core.swarm.model import Swarm, uav
from flockwire_lab.process import Published
from flockwire_lab.world import World

Table = dict[str, Any]

TELLO: Table = {  # lag and dead time assumed, not measured
    "airframes": {"kinematics": {"lag": 0.25, "dead_time": 0.1}},
    "gateway": {"noise": 0.001, "latency": 0.01},
    "limits": {"speed": 1.0},
}
IDEAL: Table = {"limits": {"speed": 1.5}}
AREA = 3.5  # m, half the side of the square that starts are drawn from
SPACING = 0.7  # m between starts, and from an obstacle's surface
SETTLED = 0.1  # m
DURATION = 26.0  # s
VELOCITY = (0.2, 0.0, 0.0)  # m/s, of the leader
EVERY = 5  # instants of 10 ms between two looks
ALONE: Table = {"avoidance": {"drone_safety_distance": 0.01, "margin": 0.0}}
WAYS: dict[str, Table] = {
    "by rank": {},
    "free": {"formation": {"assignment": "free"}},
    "by rank, alone": ALONE,
}


def merged(*tables: Table) -> Table:
    """Return one table of all, the inner tables merged."""
    result: Table = {}
    for table in tables:
        for key, value in table.items():
            known = result.get(key)
            result[key] = merged(known, value) if isinstance(known, dict) and isinstance(value, dict) else value
    return result


class Result(NamedTuple):
    """One flight, times in s: allowed by distance and speed to moving and to standing places, and needed."""

    allowed: float
    standing: float
    settled: float


class Watch:
    """Measures one flight from the true positions."""

    def __init__(self, swarm: Swarm) -> None:
        self.allowed = self.standing = self.settled = 0.0
        self._swarm, self._order, self._looked = swarm, Mission(0, "", ""), 0
        self._places: dict[str, Vector] = {}

    def take(self, published: Published) -> None:
        """Look at one message."""
        kind, owner = published.key
        if kind not in ("truth", "mission"):
            return
        message: Any = published.message
        if isinstance(message, Mission):
            self._order = message
        elif isinstance(message, Pose):
            self._places[owner] = message.position
            order = self._order
            if owner == uav(self._swarm.flying[-1]) and order.in_formation and message.stamp >= order.start:
                self._look((message.stamp - order.start) / SECOND)

    def _look(self, t: float) -> None:
        self._looked += 1
        if self._looked % EVERY != 1:
            return
        swarm = self._swarm
        formation = flown_formation({"": swarm.build_formation()}, self._order)
        leader = self._places[uav(0)]
        ways = [
            (self._places[uav(i)], add(leader, formation.offset(rank, t))) for rank, i in enumerate(swarm.followers)
        ]
        errors = [dist(here, place) for here, place in ways]
        if self._looked == 1:
            speed = swarm.limits.speed
            self.standing = max(errors) / speed
            self.allowed = max(reached_after(here, place, speed) for here, place in ways)
        if max(errors) > SETTLED:
            self.settled = t


def reached_after(start: Vector, place: Vector, speed: float) -> float:
    """Return the time, s, after which a drone at `speed` can be at a `place` that moves with the leader."""
    time = 0.0
    for _ in range(50):  # contracts by the leader's share of the speed
        time = dist(start, add(place, scale(VELOCITY, time))) / speed
    return time


def swarm_of(number: int, followers: int, airframe: Table, way: Table) -> Swarm:
    """Return the swarm of a flight."""
    chance, starts = Random(f"settling {number}"), [(0.0, 0.0)]
    while len(starts) <= followers:
        start = (chance.uniform(-AREA, AREA), chance.uniform(-AREA, AREA))
        if min(dist(start, other) for other in starts) >= SPACING:
            starts.append(start)
    table = {
        "name": "settling",
        "formation": {"kind": "grid"},
        "leader": {"trajectory": {"kind": "constant", "velocity": VELOCITY}},
        "graph": {"edges": [[(i - 1) // 3, i] for i in range(1, followers + 1)]},
        "drones": [{"id": i, "start": [*start, 0.0]} for i, start in enumerate(starts)],
        "limits": {"fence": {"min": [-12.0, -12.0, -0.5], "max": [20.0, 12.0, 3.0]}},
    }
    return parse_swarm(merged(table, airframe, way), "settling")


def fly(way: str, followers: int, airframe: Table, number: int) -> Result:
    """Fly one flight."""
    swarm = swarm_of(number, followers, airframe, WAYS[way])
    watch = Watch(swarm)
    World(swarm, number, DURATION, tap=watch.take).run()
    return Result(watch.allowed, watch.standing, watch.settled)


def main() -> int:
    """Print the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=10)
    parser.add_argument("--followers", type=int, default=8)
    parser.add_argument("--airframe", choices=("tello", "ideal"), default="tello")
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    airframe = TELLO if args.airframe == "tello" else IDEAL
    headings = ("allowed, s", "settled, s", "of allowed", "of standing")
    print(f"{'median / worst':15}" + "".join(f"{heading:>16}" for heading in headings))
    with ProcessPoolExecutor(args.jobs) as pool:
        for way in WAYS:
            found = list(pool.map(partial(fly, way, args.followers, airframe), range(args.flights)))
            columns = (
                [r.allowed for r in found],
                [r.settled for r in found],
                [r.settled / r.allowed for r in found],
                [r.settled / r.standing for r in found],
            )
            row = "".join(f"{f'{median(column):.2f} / {max(column):.2f}':>16}" for column in columns)
            print(f"{way:15}{row}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
