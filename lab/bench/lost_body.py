"""A drone that the tracker loses, in virtual time: whether the others keep clear of it, in flight and when they land.

    python lab/bench/lost_body.py [--runs 100] [--seed 0]

Each flight draws where the others are (above the lost one, below it, or on their way across its place), which drone is
lost, for 1.5 or 10 s, when (from take-off to landing), whether it lands blind after 1 s or hovers blind for 6 s first,
and an ideal airframe or a Tello's lag with noisy, late cameras. Printed: the smallest distance, m, of any drone from
the lost one, from the loss on to the end, in the air and on the ground, and of any two others in the air. A flight
fails where one of both is less than the safety distance, or a drone does not come down; then the status is 1.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from itertools import combinations
from math import dist, inf
from random import Random
from typing import Any

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import parse_swarm
from flockwire_core.process.fault_file import parse_faults
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.plan import Plan
from flockwire_lab.process import Published
from flockwire_lab.world import World

STACKS = {1: (0.0, 0.0, 0.8), 2: (1.3, 0.0, 0.0), 3: (1.3, 0.0, 0.8), 4: (1.3, 1.0, 0.3)}  # offsets, m
CASES = {"above": (0, 2), "below": (1, 3), "across": (1, 2, 3, 4)}  # where the others are: who may be lost
DURATION, EARLIEST, LATEST = 8.0, 0.5, 9.5  # s from the order to take off
DOWN = 0.05  # m


@dataclass
class Result:
    """What one flight showed; distances in m, from the loss on: of the lost drone, of any two others."""

    seed: int
    case: str
    lost: int
    at: float
    unseen: float
    nearest: float = inf
    others: float = inf
    high: tuple[str, ...] = ()
    safe: float = 0.4

    @property
    def well(self) -> bool:
        """Whether all kept clear and came down."""
        return min(self.nearest, self.others) >= self.safe and not self.high

    def row(self) -> str:
        """Return the line to print."""
        loss = f"{uav(self.lost)} unseen for {self.unseen:4.1f} s from {self.at:5.2f} s"
        gaps = f"nearest {self.nearest:.3f} m, others {self.others:.3f} m"
        return (
            f"{self.seed:4}  others {self.case:6}  {loss}  {gaps}  {'ok' if self.well else 'FAIL'}  {self.high or ''}"
        )


def swarm_of(case: str, chance: Random) -> Swarm:
    """Return the swarm of a flight: a leader that stands in the air, and four followers stacked, or on a circle."""
    frames = [f"{t},{i},{x},{y},{z}" for i, (x, y, z) in STACKS.items() for t in (0, 1000)]
    stacked = {"kind": "key_frames", "file": "bench.csv", "frames": "\n".join(("t,drone,x,y,z", *frames))}
    table: dict[str, Any] = {
        "name": "lost",
        "formation": {"kind": "circle", "radius": 1.0, "rate": 0.6} if case == "across" else stacked,
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}},
        "graph": {"edges": [[0, i] for i in STACKS]},
        "limits": {"speed": 1.5, "fence": {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}},
        "drones": [
            {"id": i, "start": [x, y, 0.0]}
            for i, (x, y) in enumerate(((0.0, 0.0), (0.0, 1.0), (1.3, -0.7), (1.0, 1.0), (-1.0, -0.5)))
        ],
    }
    if chance.random() < 0.5:
        table["limits"]["staleness"] = {"pose_land": 6.0}
    if chance.random() < 0.5:
        table["airframes"] = {"kinematics": {"lag": 0.25, "dead_time": 0.1}}
        table["gateway"] = {"noise": 0.001, "latency": 0.01}
    return parse_swarm(table, "bench")


class Watch:
    """The distances of one flight, in every frame from the loss on."""

    def __init__(self, result: Result) -> None:
        self.result = result
        self._began: int | None = None
        self._frame: dict[int, Vector] = {}
        self._at = 0

    def take(self, published: Published) -> None:
        """Look at a message."""
        if published.key.kind not in ("truth", "mission"):
            return
        message: Any = published.message
        if isinstance(message, Mission):
            self._began = self._began or published.at
        elif isinstance(message, Pose):
            if published.at != self._at:
                self.judge()
                self._at = published.at
            self._frame[int(published.key.owner.removeprefix("uav"))] = message.position

    def judge(self) -> None:
        """Judge the positions of one moment."""
        result, frame = self.result, self._frame
        if self._began is None or (self._at - self._began) / SECOND < result.at:
            return
        for (i, a), (j, b) in combinations(frame.items(), 2):
            if a[2] <= DOWN and b[2] <= DOWN and result.lost not in (i, j):
                continue
            if result.lost in (i, j):
                result.nearest = min(result.nearest, dist(a, b))
            else:
                result.others = min(result.others, dist(a, b))
        result.high = tuple(f"{uav(i)} at {place[2]:.2f} m" for i, place in frame.items() if place[2] > DOWN)


def fly(seed: int) -> Result:
    """Fly the flight of `seed`."""
    chance = Random(f"lost body {seed}")
    case = tuple(CASES)[seed % len(CASES)]
    lost, unseen = chance.choice(CASES[case]), chance.choice((1.5, 10.0))
    swarm, at = swarm_of(case, chance), round(chance.uniform(EARLIEST, LATEST), 3)
    result = Result(seed, case, lost, at, unseen, safe=swarm.avoidance.drone_safety_distance)
    watch = Watch(result)
    fault = {"at": at, "kind": "tracker", "drone": lost, "duration": unseen}
    World(swarm, seed, DURATION, parse_faults({"faults": [fault]}, Plan(swarm), "bench"), watch.take).run()
    watch.judge()
    return result


def main() -> int:
    """Fly all; returns 1 when one failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    results = []
    for seed in range(options.seed, options.seed + options.runs):
        result = fly(seed)
        results.append(result)
        print(result.row(), flush=True)
    for case in CASES:
        of_case = [result for result in results if result.case == case]
        if of_case:
            nearest = min(result.nearest for result in of_case)
            print(f"{case:6} {sum(result.well for result in of_case)} of {len(of_case)}, nearest {nearest:.3f} m")
    print(f"{sum(result.well for result in results)} of {len(results)}")
    return not all(result.well for result in results)


if __name__ == "__main__":
    sys.exit(main())
