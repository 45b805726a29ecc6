"""Drones get round what is in their way: families of drawn flights (tests/shared/around_cases.py), by their bars."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations
from math import dist, hypot, inf
from typing import Any

import pytest
from around_cases import FAMILIES, KEPT, Flight
from flockwire_core.control.barrier import nearest_on_segment
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.world import World
from settling import IDEAL, TELLO, merged

OFF = 0.1  # m from its place from which on a follower is off it
EVERY = 5  # instants of 10 ms between two looks at the places
STAYED = 1.0  # s at its place after which a follower has arrived: a leader that jumps to its speed leaves it behind
SOON = 15.0  # s off its place, at most, since the last thing was in the way
BACK = 5.0  # s off a free place, behind a person
SLACK, GRACE = 1.5, 3.0  # times the shortest detour and the forbidden time, and s more: bars of crossings
DETOUR_TOLERANCE = 0.05  # m
SLOWER = 2.5  # times the free way's time: bar of exchanges


@dataclass
class Result:
    """One flight: smallest distances and largest deviation in m, times in s."""

    drones: float = inf
    obstacles: float = inf
    person: float = inf
    deviation: float = 0.0  # since each follower arrived at its place
    off: float = 0.0  # s off the place since then, of the worst follower
    away: float = 0.0
    late: float = 0.0
    settled: float = inf  # s until all were at their places for the first time and stayed to the end
    stuck: int = 0  # followers off a place at the end that had been free for SOON
    why: list[str] = field(default_factory=list)


class Watch:
    """Measures a flight from the true positions."""

    def __init__(self, swarm: Swarm, flight: Flight, result: Result) -> None:
        self._swarm, self._flight, self._result = swarm, flight, result
        self._formation, self._virtual = swarm.build_formation(), swarm.leader.kind == "virtual"
        self._start = self._end = self._began = self._judged_from = 0
        self._stamp, self._looked = 0, 0
        self._places: dict[str, Vector] = {}
        self._leader: Vector = swarm.leader.start or (0.0, 0.0, 0.0)
        self._stayed = dict.fromkeys(swarm.followers, 0.0)  # s at its place, until it has arrived
        self._off = dict.fromkeys(swarm.followers, 0.0)  # s off its place since it arrived
        self._away = dict.fromkeys(swarm.followers, 0.0)  # s off it while it was not forbidden, until now
        self._late = dict.fromkeys(swarm.followers, 0.0)  # s of these since something was in the way
        self._settled = 0.0

    def take(self, published: Published) -> None:
        """Receive one message."""
        kind, owner = published.key
        if kind not in ("truth", "mission") and not (self._virtual and kind == "pose" and owner == "uav0"):
            return
        message: Any = published.message
        if isinstance(message, Mission):
            self._began = self._began or published.at
            self._judged_from = self._began + round(min((f["at"] for f in self._flight.faults), default=0.0) * SECOND)
            self._start = message.start if message.verb == "start" else self._start
            self._end = self._end or (message.stamp if message.verb == "land" else 0)
        elif isinstance(message, Pose):
            if owner == "uav0":
                self._leader = message.position
            if kind == "truth":
                if message.stamp != self._stamp:
                    self._look()
                    self._stamp = message.stamp
                self._places[owner] = message.position

    def done(self) -> None:
        """Judge the end of the flight."""
        result = self._result
        result.off = max(self._off.values())
        result.settled = self._settled
        result.stuck = sum(1 for away in self._away.values() if away > SOON)

    def _look(self) -> None:
        if not self._start or self._stamp < self._start or (self._end and self._stamp > self._end):
            return
        result, places, now = self._result, self._places, self._stamp
        result.drones = min([result.drones, *(dist(a, b) for a, b in combinations(places.values(), 2))])
        for x, y, _ in places.values():
            gaps = [hypot(x - o.center[0], y - o.center[1]) - o.radius for o in self._swarm.obstacles]
            result.obstacles = min([result.obstacles, *gaps])
            for (px, py), radius in self._persons():
                result.person = min(result.person, hypot(x - px, y - py) - radius)
        self._looked += 1
        if self._looked % EVERY == 0:
            for rank, i in enumerate(self._swarm.followers):
                place = add(self._leader, self._formation.offset(rank, (now - self._start) / SECOND))
                self._judge(i, place)

    def _judge(self, i: int, place: Vector) -> None:
        error = dist(self._places[uav(i)], place)
        result, dt, off = self._result, EVERY * 0.01, error > OFF
        if off:
            self._settled = (self._stamp - self._start) / SECOND
        if self._stayed[i] < STAYED:
            self._stayed[i] = 0.0 if off else self._stayed[i] + dt
        else:
            result.deviation = max(result.deviation, error)
            self._off[i] += dt if off else 0.0
        counts = off and not self._in_the_way(place, place, ()) and self._stamp > self._judged_from
        self._away[i] = self._away[i] + dt if counts else 0.0
        others = (self._places[uav(j)] for j in self._swarm.flying if j != i)
        free = counts and not self._in_the_way(self._places[uav(i)], place, others)
        self._late[i] = self._late[i] + dt if free else 0.0
        result.away, result.late = max(result.away, self._away[i]), max(result.late, self._late[i])

    def _persons(self) -> Iterator[tuple[tuple[float, float], float]]:
        t = (self._stamp - self._began) / SECOND
        for fault in self._flight.faults:
            since = t - fault["at"]
            if 0.0 <= since <= fault["duration"]:
                (x, y, _), (vx, vy, _) = fault["start"], fault["velocity"]
                yield (x + since * vx, y + since * vy), self._swarm.gateway.person_radius

    def _in_the_way(self, begin: Vector, end: Vector, drones: Iterable[Vector]) -> bool:
        """Return whether an obstacle, a person or one of `drones` is too near to the line from `begin` to `end`."""
        discs = [*(((o.center[0], o.center[1]), o.radius) for o in self._swarm.obstacles), *self._persons()]
        kept = [(center, radius + KEPT) for center, radius in discs]
        kept += [((x, y), self._swarm.avoidance.safe.drone) for x, y, _ in drones]
        return any(
            hypot(*nearest_on_segment((begin[0] - x, begin[1] - y, 0.0), (end[0] - x, end[1] - y, 0.0))) < distance
            for (x, y), distance in kept
        )


def fly(family: str, number: int, airframe: dict[str, Any]) -> Result:
    """Fly one flight and judge it by the bars of its family."""
    flight, result = FAMILIES[family](number, airframe), Result()
    swarm = parse_swarm(merged(flight.table, {"control": {"law": "extended"}}), family)
    watch = Watch(swarm, flight, result)
    faults = parse_faults({"faults": flight.faults}, Plan(swarm), "bench") if flight.faults else ()
    outcome = World(swarm, number, flight.duration, faults, watch.take).run()
    watch.done()
    result.why = [outcome.failure] if outcome.failure else []
    safe = swarm.avoidance.safe
    bars = [
        ("drones", result.drones, safe.drone, False),
        ("obstacles", result.obstacles, safe.obstacle, False),
        *_bars(family, flight, result, swarm.limits.speed),
    ]
    result.why += [
        f"{name} {value:.3f} (bar {bar:.3f})"
        for name, value, bar, most in bars
        if (value > bar if most else value < bar)
    ]
    return result


def _bars(family: str, flight: Flight, result: Result, speed: float) -> Iterator[tuple[str, float, float, bool]]:
    """Yield name, value and bar of what a family must meet besides its distances, and whether the bar is the most."""
    if family in ("swap", "corridor"):
        yield "settled", result.settled, SLOWER * (flight.way / (0.8 * speed) + 1.5), True
    elif family == "crossing":
        yield "deviation", result.deviation, SLACK * flight.detour + DETOUR_TOLERANCE, True
        yield "off", result.off, SLACK * flight.forbidden + GRACE, True
    elif family == "person":
        yield "person", result.person, 0.3, False
        yield "away", result.away, BACK, True
    else:
        yield "late", result.late, SOON, True
        yield "stuck", float(result.stuck), 0.0, True


@pytest.mark.parametrize(("number", "airframe"), [(3, TELLO), pytest.param(0, IDEAL, marks=pytest.mark.long)])
def test_a_place_that_crosses_an_obstacle_costs_little_more_than_the_shortest_detour(
    number: int, airframe: dict[str, Any]
) -> None:
    assert fly("crossing", number, airframe).why == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("family", "number"),
    [("corridor", 1), ("swap", 3), ("person", 1), ("obstacles", 0)],
    ids=["four exchange sides through a narrow gap", "twelve exchange sides", "a person", "obstacles"],
)
def test_nobody_waits_for_ever(family: str, number: int) -> None:
    """In the corridor two of four mirrored each other's way without end, before sides were kept longer each time."""
    assert fly(family, number, TELLO).why == []
