"""Drawn flights of laws that know no safety: what the safety filter keeps.

A flight is a point of the unit cube: law (law_hostile.py), drones, starts, obstacles, fence, limits of speed and of
acceleration (0.3 to 10 m/s^2), an airframe with or without lag. Persons, one or two, walk through it at 0.3 to
1.5 m/s. Margins are m above what is promised: between drones, to obstacles, to persons, within the fence (0.02 m
beyond it are allowed). Among people only a person's counts, in flights whose drones could always give way: `cornered`
are those whose status says that no velocity within their limits did.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import cos, dist, hypot, inf, pi, sin
from random import Random
from typing import Any

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import CORNERED, Status
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.search.space import Genes
from flockwire_lab.world import World
from flockwire_twins.multirotor.swarm_file import MODELS

GENES = 96  # coordinates of a flight
DURATION = 8.0  # s, from the order to take off to that to land, where a flight ends here
OUTSIDE = 0.02  # m beyond the fence that are allowed
TAKEN_OFF = 2.5  # s after the order to take off at the earliest: persons set out
LAWS = ("ToOnePoint", "ToOnePoint", "StraightOn", "StraightOn", "BangBang", "Chance", "Chase", "Graze", "Slip")
Table = dict[str, Any]


@dataclass
class Result:
    """The least margins of one flight, m, by what they are kept from, and whether no way was left from a person."""

    among_people: bool
    margins: dict[str, float] = field(default_factory=dict)
    cornered: bool = False

    @property
    def breached(self) -> dict[str, float]:
        """The margins below zero that count: people come first, then what they leave."""
        counts = ("drone", "obstacle", "fence") if not self.among_people else () if self.cornered else ("person",)
        return {what: margin for what, margin in self.margins.items() if margin < 0.0 and what in counts}


def drawn(point: Sequence[float], people: bool) -> tuple[Table, list[Table]]:
    """Return the swarm and the faults of a point."""
    chance = Genes(point)
    law, count = chance.choice(LAWS), chance.randint(2, 7)
    half, speed = chance.uniform(2.2, 4.5), chance.uniform(0.7, 3.0)
    acceleration = 0.3 * (10.0 / 0.3) ** chance.random()
    lag, dead_time = chance.choice(((0.0, 0.0), (0.2, 0.08), (0.1, 0.02), (0.25, 0.1)))
    noise, latency, lasting = chance.choice((0.0, 0.001)), chance.choice((0.0, 0.01)), chance.uniform(0.1, 1.5)
    high = chance.choice((0.0, 0.0, 0.5))
    places, obstacles = list[tuple[float, float, float]](), list[Table]()
    centre = (chance.uniform(-0.4, 0.4) * half, chance.uniform(-0.4, 0.4) * half, chance.uniform(0.8, 1.4))
    for _ in range(chance.randint(0, 4)):
        x, y, r = chance.uniform(-half, half), chance.uniform(-half, half), chance.uniform(0.05, 0.4)
        if min((hypot(x - a, y - b) - q - r for a, b, q in places), default=9.0) > 0.0:
            places.append((x, y, r))
            obstacles.append({"center": [x, y, 0.0], "radius": r})
    fence: Table = {"min": [-half, -half, -0.5], "max": [half, half, 2.5]}
    slant = 0.2 if chance.random() < 0.2 else 0.0  # of one side
    if slant:
        fence["polygon"] = [[-half, -half], [half, -half], [half, half], [-half, half - 2.0 * slant * half]]
    starts = list[tuple[float, float]]()
    for _ in range(400):
        x, y = chance.uniform(0.5 - half, half - 0.5), chance.uniform(0.5 - half, half - 0.5)
        clear = y < half - slant * (half - x) - 0.45 and all(hypot(x - a, y - b) > r + 0.5 for a, b, r in places)
        if clear and all(dist((x, y), other) > 0.7 for other in starts):
            starts.append((x, y))
            if len(starts) > count:
                break
    ways = []
    for x, y in starts[1:]:
        aim = chance.choice((centre[:2], (half * chance.choice((-1.0, 1.0)), half * chance.choice((-1.0, 1.0)))))
        ways.append([aim[0] - x, aim[1] - y, chance.choice((0.0, 0.0, -high, high)) * half])
    table: Table = {
        "name": "hostile",
        "formation": {"kind": "circle", "radius": 1.0},
        "graph": {"edges": [[0, i] for i in range(1, len(starts))]},
        "drones": [{"id": i, "start": [*start, 0.0]} for i, start in enumerate(starts)],
        "obstacles": obstacles,
        "limits": {"speed": speed, "acceleration": acceleration, "fence": fence},
        "control": {
            "law": f"law_hostile:{law}",
            "parameters": {"point": list(centre), "ways": ways, "lasting": lasting},
        },
        "gateway": {"noise": noise, "latency": latency},
        "airframes": {"kinematics": {"lag": lag, "dead_time": dead_time}},
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}},
    }
    return table, sorted(
        (walk(chance, k, half) for k in range(chance.randint(1, 2))), key=lambda one: one["at"]
    ) if people else []


def walk(chance: Random, number: int, half: float) -> Table:
    """Return a person's straight way through the middle third of the room."""
    pace, heading = chance.uniform(0.3, 1.5), chance.uniform(-pi, pi)
    c, s = cos(heading), sin(heading)
    through, length = [chance.uniform(-0.4, 0.4) * half for _ in range(2)], half + 1.0
    return {
        "kind": "visitor",
        "body": f"person {number}",
        "at": TAKEN_OFF + chance.uniform(0.0, 3.0),
        "start": [through[0] - length * c, through[1] - length * s, 1.2],
        "velocity": [pace * c, pace * s, 0.0],
        "duration": 2.0 * length / pace,
    }


class Watch:
    """Measures the margins of a flight from the true positions, while the formation is ordered."""

    def __init__(self, swarm: Swarm, persons: Sequence[Table]) -> None:
        self.result, self.ordered = Result(bool(persons)), False
        self.stop: Callable[[], None] = lambda: None
        self._swarm, self._persons, self._began = swarm, persons, 0
        self._places: dict[str, Vector] = {}
        self._room, self._last = swarm.limits.fence.room(), uav(swarm.flying[-1])

    def take(self, published: Published) -> None:
        """Look at one message."""
        if published.key.kind not in ("truth", "mission", "status"):
            return
        message: Any = published.message
        if isinstance(message, Mission):
            self._began = self._began or published.at
            if self.ordered and not message.in_formation:
                self.stop()
            self.ordered = message.in_formation
        elif isinstance(message, Status):
            self.result.cornered |= any(name == CORNERED for name, _ in message.report.counts)
        elif isinstance(message, Pose):
            self._places[published.key.owner] = message.position
            if self.ordered and published.key.owner == self._last:
                self._look((message.stamp - self._began) / SECOND)

    def _look(self, t: float) -> None:
        safe, places = self._swarm.avoidance.safe, list(self._places.values())
        self._least("drone", min((dist(a, b) for a, b in combinations(places, 2)), default=inf) - safe.drone)
        for x, y, z in places:
            self._least("fence", OUTSIDE - self._room.outside((x, y, z)))
            for obstacle in self._swarm.obstacles:
                gap = hypot(x - obstacle.center[0], y - obstacle.center[1]) - obstacle.radius
                self._least("obstacle", gap - safe.obstacle)
            for person in self._persons:
                walked = t - person["at"]
                if 0.0 <= walked <= person["duration"]:
                    px, py = (s + walked * v for s, v in zip(person["start"][:2], person["velocity"][:2], strict=True))
                    gap = hypot(x - px, y - py) - self._swarm.gateway.person_radius
                    self._least("person", gap - safe.obstacle)

    def _least(self, what: str, margin: float) -> None:
        self.result.margins[what] = min(self.result.margins.get(what, inf), margin)


def measured(table: Table, faults: Sequence[Table] = (), duration: float = DURATION, seed: int = 0) -> Result:
    """Fly a swarm; return its margins."""
    swarm = parse_swarm(table, "hostile")
    watch = Watch(swarm, faults)
    world = World(swarm, seed, duration, parse_faults({"faults": list(faults)}, Plan(swarm), "hostile"), watch.take)
    watch.stop = world.scheduler.stop
    world.run()
    return watch.result


def fly(point: Sequence[float], people: bool = False) -> Result:
    """Fly the flight of a point."""
    return measured(*drawn(point, people))


def fly_multirotors(point: Sequence[float]) -> Result:
    """Fly the flight of a point with multirotors, of one model, by the fitted model or with rotors."""
    table, faults = drawn(point, people=False)
    make_multirotors(table, point[-1], rotors=point[-2] < 0.3)
    return measured(table, faults)


def make_multirotors(table: Table, choice: float, rotors: bool) -> None:
    """Make the drones of a swarm multirotors of one model, chosen by a number in [0, 1)."""
    model = [*MODELS][int(choice * len(MODELS))]
    identified = {"lag": 0.14, "dead_time": 0.16} if model == "quad_1kg" else {}  # s (docs/multirotor.md)
    table.setdefault("airframes", {})["multirotor"] = {"model": model, "rotors": rotors, **identified}
    for drone in table["drones"]:
        drone["airframe"] = "multirotor"


def point_of(number: int) -> tuple[float, ...]:
    """Return the point of a draw."""
    chance = Random(f"hostile {number}")
    return tuple(chance.random() for _ in range(GENES))
