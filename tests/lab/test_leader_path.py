"""The leader's path through two obstacles, crossed by a follower: it keeps clear, and reaches its end."""

from __future__ import annotations

from dataclasses import dataclass
from math import dist, hypot, inf
from pathlib import Path
from random import Random
from typing import Any

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import load_table, parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_lab.process import Published
from flockwire_lab.world import World

FILE = Path(__file__).with_name("leader_path.toml")
LONGEST = 90.0  # s from take-off
SPREAD = {0: (0.4, 1.2), 1: (1.6, 3.2)}  # m, the boxes round the file's starts that starts are drawn from
SPACING = 0.6  # m between starts, and from an obstacle's surface
ARRIVED = 0.05  # m from the path's end, for a second


@dataclass
class Run:
    """One flight: smallest distances in m, s in formation until the leader rested at the end (inf: it never did)."""

    drones: float = inf
    leader_obstacle: float = inf
    obstacle: float = inf
    arrived: float = inf
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
            self._places[published.key.owner] = message.position
            if self._start and message.stamp >= self._start:
                self._look(published.key.owner, message)

    def _look(self, owner: str, pose: Pose) -> None:
        run, (x, y, _) = self._run, pose.position
        gap = min(hypot(x - o.center[0], y - o.center[1]) - o.radius for o in self._swarm.obstacles)
        run.obstacle = min(run.obstacle, gap)
        if owner != "uav0":
            run.drones = min(run.drones, dist(self._places["uav0"], pose.position))
            return
        run.leader_obstacle = min(run.leader_obstacle, gap)
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
    run, swarm = Run(), drawn(number, changes)
    watch = Watch(swarm, run)
    watch.world = World(swarm, number, LONGEST, (), watch.tap)
    watch.world.run()
    run.failure = watch.world.director.failure
    return run


TELLO = {
    "airframes": {"kinematics": {"lag": 0.25, "dead_time": 0.1}},  # assumed, not measured
    "gateway": {"noise": 0.001, "latency": 0.01},
}


@pytest.mark.parametrize("number", [0, *(pytest.param(n, marks=pytest.mark.long) for n in range(1, 12))])
@pytest.mark.parametrize("changes", [{}, TELLO], ids=["ideal", "a Tello's lag"])
def test_the_leader_keeps_clear_and_reaches_its_end(number: int, changes: dict[str, Any]) -> None:
    run = fly(number, changes)
    assert (run.failure, run.arrived < 60.0) == ("", True)
    assert run.drones >= 0.4
    assert run.obstacle >= 0.3


def test_without_the_safety_filter_it_flies_through_them() -> None:
    run = fly(0, {"control": {"safety_filter": False}})
    assert run.leader_obstacle < 0.3
    assert run.arrived < inf
