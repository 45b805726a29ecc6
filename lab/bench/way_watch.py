"""Measures a flight round what is in the way from the true positions, for ways.py."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations
from math import dist, hypot, inf
from typing import Any, cast

from flockwire_core.control.barrier import nearest_on_segment
from flockwire_core.domain.airframe import Command
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from flockwire_core.swarm.model import Swarm, uav
from flockwire_lab.process import Published
from law_noted import BACKWARDS, NOTED, SENT
from way_draws import KEPT, Flight

OFF = 0.1  # m from its place from which on a follower is off it
EVERY = 5  # instants of 10 ms between two looks at the places
STAYED = 1.0  # s at its place after which a follower has arrived: a leader that jumps to its speed leaves it behind
SOON = 15.0  # s off its place, at most, since the last thing was in the way
CHANGED = 0.01  # m/s


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
    steps: int = 0  # of the followers in formation, one of several
    limited: int = 0  # of these: changed by the filter's limits of speed and acceleration alone
    leaning: int = 0  # changed for what is fixed or stands
    conflicts: int = 0  # changed for others on their way
    turned: int = 0  # times that a drone turned back, of the worst follower
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
        self._errors: dict[int, Vector] = {}  # m, at the last look
        self._ahead: dict[int, Vector] = {}  # the planned direction
        self._ways: dict[int, Vector] = {}  # that from which a drone flies back
        self._against = dict.fromkeys(swarm.followers, 0.0)  # m flown against them
        self._turned = dict.fromkeys(swarm.followers, 0)

    def take(self, published: Published) -> None:
        """Receive one message."""
        kind, owner = published.key
        if kind == "command" and owner != "uav0":
            self._compare(owner, cast(Command, published.message))
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

    def _compare(self, owner: str, command: Command) -> None:
        noted = NOTED.get(owner)
        SENT[owner] = command.velocity
        if noted is not None and 0 < self._start <= self._stamp and not self._end:
            result, given = self._result, command.velocity
            result.steps += 1
            self._ahead[int(owner[3:])] = noted.way
            if dist(given, noted.wanted) > CHANGED:
                if dist(given, noted.limited) <= CHANGED:
                    result.limited += 1
                elif dist(noted.fixed, noted.limited) > CHANGED:
                    result.leaning += 1
                else:
                    result.conflicts += 1

    @property
    def lasted(self) -> float:
        """The length of the formation phase, s."""
        return (self._end - self._start) / SECOND

    def done(self) -> None:
        """Judge the end of the flight."""
        result = self._result
        result.off = max(self._off.values())
        result.settled = self._settled
        result.turned = max(self._turned.values())
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
                self._follow(i, subtract(self._places[uav(i)], place))

    def _follow(self, i: int, error: Vector) -> None:
        """Count how often a follower flies more than BACKWARDS against the direction that it had planned.

        The direction is the newest one, but while the drone flies back that from which on it does.
        """
        moved = subtract(error, self._errors.get(i, error))
        self._errors[i] = error
        way = self._ways.get(i, ZERO)
        self._against[i] = max(self._against[i] - moved[0] * way[0] - moved[1] * way[1], 0.0)
        if self._against[i] > BACKWARDS:
            self._turned[i] += 1
            self._against[i] = 0.0
        if self._against[i] == 0.0:
            self._ways[i] = self._ahead.get(i, ZERO)

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
