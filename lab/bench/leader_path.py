"""How the leader gets along a path that leads through two obstacles and is crossed by a follower, as a table.

    python lab/bench/leader_path.py [RUNS] [--first 0] [--jobs 2]

Flies leader_path.toml in virtual time, each run from a random start of its own, until the leader rests at the end.
Exit status 1 when in any run it did not get there within LONGEST, or somebody came below the safety distance.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from math import dist, hypot, inf
from pathlib import Path
from random import Random
from typing import Any

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import load_table, parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_lab.process import Published
from flockwire_lab.world import World

FILE = Path(__file__).with_suffix(".toml")
RUNS = 200
LONGEST = 90.0  # s from take-off
SPREAD = {0: (0.4, 1.2), 1: (1.6, 3.2)}  # m, the boxes round the file's starts that starts are drawn from
SPACING = 0.6  # m between starts, and from an obstacle's surface
ARRIVED = 0.05  # m from the path's end, for a second


@dataclass
class Run:
    """One flight: smallest distances in m, s in formation until the leader rested at the end (inf: it never did)."""

    number: int
    drones: float = inf
    leader_obstacle: float = inf
    obstacle: float = inf
    arrived: float = inf
    fastest: float = 0.0  # m/s, of the leader
    failure: str = ""


class Watch:
    """Measures a flight from the true places of its drones."""

    def __init__(self, swarm: Swarm, run: Run) -> None:
        self.world: World | None = None
        self._swarm, self._run, self._start = swarm, run, 0
        self._places: dict[str, tuple[float, float, float]] = {}
        self._end: tuple[float, float, float] | None = None
        self._since: int | None = None

    def tap(self, published: Published) -> None:
        """Receive one message."""
        if published.key.kind not in ("truth", "mission"):
            return
        message = published.message
        if isinstance(message, Mission) and message.verb == "start":
            self._start = message.start
        elif isinstance(message, Pose):
            before = self._places.get(published.key.owner)
            self._places[published.key.owner] = message.position
            if self._start and message.stamp >= self._start:
                self._look(published.key.owner, message, before)

    def _look(self, owner: str, pose: Pose, before: Sequence[float] | None) -> None:
        run, (x, y, _) = self._run, pose.position
        gap = min(hypot(x - o.center[0], y - o.center[1]) - o.radius for o in self._swarm.obstacles)
        run.obstacle = min(run.obstacle, gap)
        if owner != "uav0":
            run.drones = min(run.drones, dist(self._places["uav0"], pose.position))
            return
        run.leader_obstacle = min(run.leader_obstacle, gap)
        run.fastest = max(run.fastest, dist(before or pose.position, pose.position) * self._swarm.gateway.rate_hz)
        way: Any = self._swarm.leader.trajectory
        self._end = self._end or tuple(a + b for a, b in zip(pose.position, way.points[-1], strict=True))
        if dist(pose.position, self._end) > ARRIVED:
            self._since = None
        elif self._since is None:
            self._since = pose.stamp
        elif pose.stamp > self._since + SECOND and self.world is not None:
            run.arrived = (self._since - self._start) / SECOND
            self.world.scheduler.stop()


def drawn(number: int, changes: dict[str, Any] | None = None) -> Swarm:
    """Return the swarm with the starts of run `number`, some of its tables replaced."""
    table: dict[str, Any] = {**load_table(FILE), **(changes or {})}
    chance = Random(f"leader path {number}")
    while True:
        places = [
            [
                c + (chance.random() - 0.5) * width
                for c, width in zip(drone["start"][:2], SPREAD[drone["id"]], strict=True)
            ]
            for drone in table["drones"]
        ]
        gaps = [dist(p, o["center"][:2]) - o["radius"] for p in places for o in table["obstacles"]]
        if min(*gaps, dist(*places)) >= SPACING:
            break
    drones = [{**drone, "start": [*place, 0.0]} for drone, place in zip(table["drones"], places, strict=True)]
    return parse_swarm({**table, "drones": drones}, str(FILE))


def fly(number: int, changes: dict[str, Any] | None = None) -> Run:
    """Fly run `number` until the leader has arrived, or for LONGEST."""
    run, swarm = Run(number), drawn(number, changes)
    watch = Watch(swarm, run)
    watch.world = World(swarm, number, LONGEST, (), watch.tap)
    watch.world.run()
    run.failure = watch.world.director.failure
    return run


def good(run: Run, swarm: Swarm) -> bool:
    """Return whether the leader arrived and all kept their distances."""
    safe = swarm.avoidance
    apart = run.drones >= safe.drone_safety_distance and run.obstacle >= safe.obstacle_safety_distance
    return apart and run.arrived < inf and not run.failure


TELLO = {
    "airframes": {"kinematics": {"lag": 0.25, "dead_time": 0.1}},  # assumed, not measured
    "gateway": {"noise": 0.001, "latency": 0.01},
}
CASES: dict[str, dict[str, Any]] = {"ideal airframe": {}, "a Tello's lag": TELLO}


def main() -> None:
    """Fly all and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", metavar="RUNS", type=int, nargs="?", default=RUNS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.runs)
    swarm, all_good = drawn(0), True
    print(f"{'':16}{'good':>12}{'drones, m':>12}{'obstacles, m':>15}{'leader to them':>16}{'arrived, s':>16}{'m/s':>6}")
    for name, changes in CASES.items():
        with ProcessPoolExecutor(options.jobs) as pool:
            runs = list(pool.map(partial(fly, changes=changes), numbers))
        wrong = [run for run in runs if not good(run, swarm)]
        all_good = all_good and not wrong
        times = sorted(run.arrived for run in runs)
        print(
            f"{name:16}{f'{len(runs) - len(wrong)} of {len(runs)}':>12}"
            f"{min(run.drones for run in runs):12.3f}{min(run.obstacle for run in runs):15.3f}"
            f"{min(run.leader_obstacle for run in runs):16.3f}{f'{times[len(times) // 2]:.1f} / {times[-1]:.1f}':>16}"
            f"{max(run.fastest for run in runs):6.2f}"
        )
        for run in wrong[:10]:
            print(f"  {run}")
    print("smallest distances of all runs; median and longest time to the path's end; the leader's highest speed")
    sys.exit(not all_good)


if __name__ == "__main__":
    main()
