"""Random changes of formation in virtual time: how close the drones come, how fast they fly, what is refused.

    python lab/bench/formation_changes.py [--flights 20] [--changes 10] [--followers 12] [--tello] [--seed 0]

Each flight goes through formations drawn at random (circle, line, grid, an expression; most of them turn), each change
planned as `flockwire formation` does. `jump` is the largest difference of h' across 2 us, at the order, the begin and
the end of each change; the separation is that of all airframes at all steps in the air.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from math import dist, hypot, inf, pi
from random import Random

import numpy as np
from flockwire_core.control.graph import LEADER
from flockwire_core.domain.airframe import Command
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector, distance
from flockwire_core.ground.director import Director, Stage
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.formation_planning import ChangeRefusedError, plan_change
from flockwire_core.ground.order import Order
from flockwire_core.loading import SwarmFileError, parse_swarm
from flockwire_core.pilot.orders import flown_formation
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from flockwire_lab.process import Published
from flockwire_lab.world import EPOCH, World

SETTLE = 3 * SECOND  # ns in a formation before the next change
IN_THE_AIR = 0.5  # m
EPSILON = 1e-6  # s to either side of a moment at which h' might jump
TELLO = {"kinematics": {"gain": 1.0, "lag": 0.35, "dead_time": 0.1}}


@dataclass
class Found:
    """What one flight showed: lengths in m, speeds in m/s, times in s; a reason for each change that was refused."""

    failure: str = ""
    durations: list[float] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)
    separation: float = inf
    commanded: float = 0.0
    jump: float = 0.0
    error: float = 0.0  # the largest formation error of a pilot's own reckoning, during and after changes


class ChangingDirector(Director):
    """Conducts a flight through the formations `names`, then lands."""

    def __init__(self, swarm: Swarm, names: list[str], found: Found) -> None:
        super().__init__(Plan(swarm), Order("start"), 0, EPOCH, EPOCH)
        self._swarm, self._names, self._found = swarm, names, found
        self._due = 0

    def step(self, fleet: Fleet) -> Mission | None:
        """Change to the next formation when the last one has been flown for a while."""
        order, started = super().step(fleet), self._standing.started
        if order is not None or self.stage is not Stage.FLYING or started is None:
            return order
        self._due = self._due or started.start + 2 * SETTLE
        if fleet.now < self._due:
            return None
        return self._change(fleet, started) if self._names else self.land(fleet.now)

    def _change(self, fleet: Fleet, started: Mission) -> Mission | None:
        leader = fleet.fresh[LEADER].report.position
        try:
            order = plan_change(self._swarm, started, self._names.pop(0), fleet.now, leader)
        except ChangeRefusedError as refused:
            self._found.refusals.append(str(refused))
            return None
        assert order.change is not None
        self._found.jump = max(self._found.jump, largest_jump(self._swarm, started, order))
        self._found.durations.append(order.change.duration)
        self._due = order.change.begin + nanoseconds(order.change.duration) + SETTLE
        return self._go(Stage.FLYING, order)


class Judge:
    """Looks at all that is published."""

    def __init__(self, swarm: Swarm, found: Found) -> None:
        self._found, self._plan = found, Plan(swarm)
        self._places: dict[str, Vector] = {}
        self._at = 0
        self._changing = False

    def take(self, published: Published) -> None:
        """Take one message."""
        if published.key.kind not in ("truth", "command", "status", "mission"):
            return
        match published.message:
            case Pose(position=position):
                if published.at != self._at:
                    self._judge()
                    self._at = published.at
                self._places[published.key.owner] = position
            case Command(velocity=velocity):
                self._found.commanded = max(self._found.commanded, hypot(*velocity))
            case Mission(change=change):
                self._changing = change is not None
            case Status(report=report) if self._changing and report.phase == "formation":
                self._found.error = max(self._found.error, report.formation_error)

    def _judge(self) -> None:
        points = np.array([place for place in self._places.values() if place[2] > IN_THE_AIR])
        if len(points) > 1:
            gaps = np.linalg.norm(points[:, None] - points[None, :], axis=2)
            self._found.separation = min(self._found.separation, float(gaps[~np.eye(len(points), dtype=bool)].min()))


def largest_jump(swarm: Swarm, last: Mission, order: Mission) -> float:
    """Return the largest jump of h', m/s, of any follower: between the two orders, at the begin and at the end."""
    formations = {name: swarm.build_formation(name) for name in swarm.formation_names}
    before, after = flown_formation(formations, last), flown_formation(formations, order)
    assert order.change is not None
    given, begin = ((stamp - order.start) / SECOND for stamp in (order.stamp, order.change.begin))
    end, ranks = begin + order.change.duration, range(after.count)
    handover = max(distance(before.offset_rate(i, t), after.offset_rate(i, t)) for i in ranks for t in (given, begin))
    inside = (
        dist(after.offset_rate(i, t - EPSILON), after.offset_rate(i, t + EPSILON)) for i in ranks for t in (begin, end)
    )
    return max(handover, *inside)


def drawn_formation(chance: Random) -> dict[str, object]:
    """Draw a formation."""
    match chance.choice(("circle", "line", "grid", "expression")):
        case "circle":
            return {"kind": "circle", "radius": chance.uniform(2.2, 4.0), "rate": chance.uniform(-0.3, 0.3)}
        case "line":
            heading, rate = chance.uniform(-pi, pi), chance.uniform(-0.1, 0.1)
            return {"kind": "line", "spacing": chance.uniform(0.7, 1.2), "heading": heading, "rate": rate}
        case "grid":
            spacing, rate = chance.uniform(0.9, 1.5), chance.uniform(-0.2, 0.2)
            return {"kind": "grid", "spacing": spacing, "columns": chance.randint(3, 5), "rate": rate}
        case _:
            a, b, w = chance.uniform(2.5, 4.0), chance.uniform(2.5, 4.0), chance.uniform(-0.25, 0.25)
            x, y = (f"{s:.3f}*{f}(2*pi*i/n + {w:.3f}*t)" for s, f in ((a, "sin"), (b, "cos")))
            return {"kind": "expression", "x": x, "y": y, "z": "0.3*sin(0.5*t + i)"}


def drawn_swarm(seed: int, followers: int, changes: int, tello: bool) -> tuple[Swarm, list[str]]:
    """Draw a swarm with as many formations as it is to change to; returns it with their names."""
    for attempt in range(1000):
        chance = Random(f"formation changes {seed} {attempt}")
        names = [f"f{k}" for k in range(changes)]
        angle = 2 * pi / followers
        starts = [[3.0 * np.sin(i * angle), 3.0 * np.cos(i * angle), 0.0] for i in range(followers)]
        table = {
            "name": "changes",
            "formation": {"kind": "circle", "radius": 3.0, "rate": chance.uniform(-0.3, 0.3)},
            "formations": {name: drawn_formation(chance) for name in names},
            "leader": {"trajectory": {"kind": "constant", "velocity": [0.05, 0.05, 0.0]}},
            "limits": {"fence": {"min": [-16.0, -16.0, -0.5], "max": [26.0, 26.0, 3.0]}},
            "graph": {"edges": [[(i - 1) // 2, i] for i in range(1, followers + 1)]},
            "drones": [{"id": 0, "start": [0.0, 0.0, 0.0]}]
            + [{"id": i + 1, "start": start} for i, start in enumerate(starts)],
            **({"airframes": TELLO} if tello else {}),
        }
        try:
            return parse_swarm(table, f"seed {seed}"), names
        except SwarmFileError:
            continue
    raise SystemExit(f"seed {seed}: no swarm of so many drones was found")


def fly(swarm: Swarm, names: list[str], seed: int) -> Found:
    """Fly through the formations `names`."""
    found = Found()
    judge = Judge(swarm, found)
    world = World(swarm, seed, 0.0, (), judge.take)
    world.conduct(ChangingDirector(swarm, names, found))
    found.failure = world.run().failure
    return found


def main() -> int:
    """Fly, print a row for each flight and the worst of all; returns the exit status."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, default in (("flights", 20), ("changes", 10), ("followers", 12), ("seed", 0)):
        options.add_argument(f"--{name}", type=int, default=default)
    options.add_argument("--tello", action="store_true", help="airframes with a Tello's lag and dead time")
    given = options.parse_args()
    every = []
    for seed in range(given.seed, given.seed + given.flights):
        swarm, names = drawn_swarm(seed, given.followers, given.changes, given.tello)
        found = fly(swarm, names, seed)
        every.append(found)
        print(f"seed {seed:3d}: {row(found)}", *found.refusals, sep="\n          refused: ", flush=True)
    worst = Found(
        "; ".join(found.failure for found in every if found.failure),
        [duration for found in every for duration in found.durations],
        [reason for found in every for reason in found.refusals],
        min(found.separation for found in every),
        *(max(getattr(found, name) for found in every) for name in ("commanded", "jump", "error")),
    )
    print(f"all     : {row(worst)}")
    return int(bool(worst.failure) or worst.separation < swarm.avoidance.drone_safety_distance)


def row(found: Found) -> str:
    """Return the figures as one line."""
    longest = f"{min(found.durations):.1f} to {max(found.durations):.1f} s" if found.durations else "none"
    return (
        f"{len(found.durations)} changes ({longest}), {len(found.refusals)} refused; separation "
        f"{found.separation:.3f} m, commands up to {found.commanded:.3f} m/s, h' jumps {1e3 * found.jump:.4f} mm/s, "
        f"formation error up to {1e3 * found.error:.1f} mm {found.failure or ''}".rstrip()
    )


if __name__ == "__main__":
    sys.exit(main())
