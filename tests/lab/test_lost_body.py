"""A drone that the tracker loses is not struck, in flight or by who lands.

Each flight draws where the others are (above the lost one, below it, or on their way across its place), which drone is
lost, for 1.5 or 10 s, when (from take-off to landing), whether it lands blind after 1 s or hovers blind for 6 s first,
and an ideal airframe or a Tello's lag with noisy, late cameras.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import dist, inf
from random import Random
from typing import Any

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.world import World

STACKS = {1: (0.0, 0.0, 0.8), 2: (1.3, 0.0, 0.0), 3: (1.3, 0.0, 0.8), 4: (1.3, 1.0, 0.3)}  # offsets, m
CASES = {"above": (0, 2), "below": (1, 3), "across": (1, 2, 3, 4)}  # where the others are: who may be lost
DURATION, EARLIEST, LATEST = 8.0, 0.5, 9.5  # s from the order to take off
DOWN = 0.05  # m


@dataclass
class Result:
    """What one flight showed; distances in m, from the loss on: of the lost drone, of any two others."""

    lost: int
    at: float
    nearest: float = inf
    others: float = inf
    high: tuple[str, ...] = ()
    safe: float = 0.4


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
    result = Result(lost, at, safe=swarm.avoidance.drone_safety_distance)
    watch = Watch(result)
    fault = {"at": at, "kind": "tracker", "drone": lost, "duration": unseen}
    World(swarm, seed, DURATION, parse_faults({"faults": [fault]}, Plan(swarm), "bench"), watch.take).run()
    watch.judge()
    return result


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(4, id="one below it, which it lands through"),
        pytest.param(36, id="one above it, unseen for 1.5 s", marks=pytest.mark.long),
        pytest.param(54, id="one above it that lands beside it"),
        pytest.param(50, id="others on a circle across its place", marks=pytest.mark.long),
        pytest.param(56, id="others on a circle across its place, closer", marks=pytest.mark.long),
        *(pytest.param(seed, marks=pytest.mark.long) for seed in range(100, 120)),
    ],
)
def test_the_others_keep_clear_of_it_and_land_beside_it(seed: int) -> None:
    result = fly(seed)
    assert (result.nearest >= result.safe, result.others >= result.safe, result.high) == (True, True, ())
