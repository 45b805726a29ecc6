"""An agent that is told, step by step, what its swarm would; and small virtual flights, watched from outside."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from math import dist, hypot, inf, sqrt
from random import Random
from statistics import fmean
from typing import Any

import pytest
from flockwire_agent.core import AgentCore
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.body import Body, Nearby
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add, limit, norm, scale, subtract
from flockwire_core.loading import parse_swarm
from flockwire_core.process.cores import Start
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.keys import MISSION, STOP, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status
from flockwire_lab.process import Published
from flockwire_lab.world import World

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100


class Cockpit:
    """Agent `number` with an ideal airframe, x' = u; whoever is in `silent` (kinds, or owners) is not heard."""

    def __init__(self, swarm: Swarm, number: int, position: Vector = (3.0, 0.0, 0.0)) -> None:
        self.now, self.swarm, self.number, self.ordered = BEGAN, swarm, number, 0
        self.core = AgentCore(Start(Plan(swarm), uav(number), BEGAN, Random(0)))
        self.position, self.leader = position, (0.0, 0.0, 1.0)
        self.leader_phase, self.leading = Phase.FORMATION, Leading.LEADS  # what it reports; what others say of it
        self.origin: int | None = None  # of the neighbours' estimates, Unix ns; None: they are news
        self.state, self.battery = FlightState.GROUNDED, 1.0
        self.bodies: tuple[Body, ...] = ()
        self.silent: set[str] = set()
        self.beside: dict[int, Vector] = {}  # m: how far a neighbour's estimate is from the truth
        self.command_age: float | None = None  # s, as its driver reports; None: old while it holds still
        self.height: float | None = None  # m, likewise; None: that of its position
        self.holds_still = False  # the airframe stays where it is: its driver obeys no command
        self.command: Command | None = None
        self.estimate: Estimate | None = None

    @property
    def velocity(self) -> Vector:
        assert self.command is not None
        return self.command.velocity

    @property
    def report(self) -> Report:
        return self.core.report(self.now)

    @property
    def phase(self) -> str:
        return self.report.phase

    def tell(self) -> None:
        """Tell the agent all that is not silent, true for now."""
        own, now = uav(self.number), self.now
        height = self.position[2] if self.height is None else self.height
        silence = self.command_age if self.command_age is not None else 1.0 * self.holds_still
        telemetry = Telemetry(now, "world", self.state, self.battery, height, silence)
        told = {
            Key("nearby", own): Nearby(now, "world", self.bodies),
            Key("telemetry", own): telemetry,
            Key("pose", own): Pose(now, "world", self.position),
        }
        for j in self.swarm.topology.neighbours(self.number):
            if j:
                origin = now if self.origin is None else self.origin
                place = add(self.leader, self.beside.get(j, (0.0, 0.0, 0.0)))
                news = Estimate(now, "world", LeaderMotion(place), origin, 1, self.leading)
                told[Key("estimate", uav(j))] = news
            else:
                told[Key("pose", uav(j))] = Pose(now, "world", self.leader)
                report = Report(self.leader_phase)
                health = Status(now, "world", "leader", report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
                told[Key("status", "leader")] = health
        for key, message in told.items():
            if not ({key.kind, key.owner} & self.silent if key.owner != own else key.kind in self.silent):
                self.core.receive(key, message, now)

    def step(self) -> None:
        """Let one period pass."""
        self.now += TICK
        self.tell()
        messages = dict(self.core.step(self.now))
        command, estimate = (
            messages.get(Key("command", uav(self.number))),
            messages.get(Key("estimate", uav(self.number))),
        )
        self.command, self.estimate = command, estimate
        if command is None:
            return
        if command.velocity[2] > 0.0 and self.state is FlightState.GROUNDED:
            self.state = FlightState.FLYING
        if self.state is FlightState.FLYING and not self.holds_still:
            self.position = add(self.position, scale(command.velocity, 0.01))
            if self.position[2] <= 0.0:
                self.state = FlightState.GROUNDED

    def run(self, seconds: float) -> None:
        """Let `seconds` pass."""
        for _ in range(round(seconds * 100)):
            self.step()

    def push(self, place: Vector) -> None:
        """Let the airframe be pushed to `place` (m), as fast as it can fly."""
        before, self.holds_still = self.holds_still, True
        while dist(self.position, place) > 1e-9:
            self.position = add(self.position, limit(subtract(place, self.position), 0.1))
            self.step()
        self.holds_still = before

    def order(self, verb: str, start: int = 0, formation: str = "", without: tuple[int, ...] = ()) -> None:
        order = Mission(self.now + 1, "world", verb, start, formation, without=without)
        self.ordered += 1
        order = order._replace(number=self.ordered)
        self.core.receive(MISSION, order, self.now)

    def stop(self) -> None:
        self.core.receive(STOP, Stop(self.now, "world", "test"), self.now)

    def fly(self) -> Cockpit:
        """Bring the agent into formation, and keep the airframe where it is from then on."""
        self.run(0.1)
        self.order("takeoff")
        self.run(2.0)
        self.order("start", self.now)
        self.run(3.0)
        assert self.phase is Phase.FORMATION
        self.holds_still = True
        return self


@pytest.fixture
def cockpit(make_swarm) -> Callable[..., Cockpit]:
    """Return the builder of an agent; its first neighbour is the leader unless `number` says otherwise."""

    def build(changes: dict[str, object] | None = None, number: int = 1, **more: Vector) -> Cockpit:
        return Cockpit(make_swarm(changes), number, **more)

    return build


@dataclass
class Watched:
    """What the drones did in flight, truly."""

    failure: str
    closest: float = inf  # m between two drones
    obstacle: float = inf  # m from an obstacle's surface
    fastest: float = 0.0  # m/s of a follower
    lowest: float = inf  # m, of a follower in formation
    highest: float = 0.0  # m, of a follower, from the start to the end
    outside: float = 0.0  # m outside the fence
    error: float = inf  # m, largest formation error of the last second
    observations: dict[str, float] = field(default_factory=dict)  # m, largest observation error of the last second
    noises: dict[str, float] = field(default_factory=dict)  # m, RMS of it about its mean in the last three seconds
    details: list[str] = field(default_factory=list, repr=False)  # what the statuses said

    @property
    def observation(self) -> float:
        """The largest observation error of all."""
        return max(self.observations.values())


def key_frames(offsets: dict[int, list[float]]) -> dict[str, Any]:
    """Return the table of a formation whose offsets stay as they are."""
    rows = [f"{t},{i},{x},{y},{z}" for i, (x, y, z) in offsets.items() for t in (0, 1000)]
    return {"kind": "key_frames", "file": "test.csv", "frames": "\n".join(("t,drone,x,y,z", *rows))}


def flock(starts: list[list[float]], offsets: dict[int, list[float]], changes: dict[str, Any]) -> Swarm:
    """Return a swarm whose followers all hear the leader, drone 0, which stays where it is."""
    table: dict[str, Any] = {
        "name": "flock",
        "formation": key_frames(offsets),
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}},
        "graph": {"edges": [[0, i] for i in offsets]},
        "drones": [{"id": i, "start": [*start, 0.0]} for i, start in enumerate(starts)],
    }
    for key, value in changes.items():
        inner = table
        *path, last = key.split(".")
        for part in path:
            inner = inner.setdefault(part, {})
        inner[last] = value
    return parse_swarm(table, "test.toml")


def watch(swarm: Swarm, duration: float, seed: int = 0) -> Watched:
    """Fly `swarm` in virtual time and watch what is true in flight; of a flight without a formation, why it failed."""
    truth: dict[int, dict[str, Pose]] = {}
    estimates: dict[str, list[Estimate]] = {f"uav{i}": [] for i in swarm.followers}
    orders: list[Mission] = []
    details: list[str] = []

    def tap(published: Published) -> None:
        kind, owner = published.key
        if kind in ("truth", "estimate", "mission", "status"):
            message = published.message
            if isinstance(message, Estimate):
                estimates[owner].append(message)
            elif isinstance(message, Pose):
                truth.setdefault(message.stamp, {})[owner] = message
            elif isinstance(message, Mission):
                orders.append(message)
            elif isinstance(message, Status) and owner.startswith("uav"):
                details.append(message.report.line)

    outcome = World(swarm, seed, duration, (), tap).run()
    watched = Watched(outcome.failure, details=details)
    watched.highest = max(p.position[2] for poses in truth.values() for owner, p in poses.items() if owner != "uav0")
    start = next((order.start for order in orders if order.verb == "start"), None)
    if start is None:
        return watched
    end = next((order.stamp for order in orders if order.verb == "land"), max(truth))
    before: dict[str, Pose] = {}
    for stamp, poses in sorted(truth.items()):
        if start <= stamp <= end and len(poses) == len(swarm.flying):
            _look(watched, swarm, poses, before)
            before = poses
            if stamp > end - SECOND:
                _judge(watched, swarm, poses, (stamp - start) / SECOND)
    stamps = sorted(truth)
    for owner, said in estimates.items():
        _hear(watched, owner, [e for e in said if end - 3 * SECOND < e.stamp < end], stamps, truth, end)
    return watched


def _hear(
    watched: Watched, owner: str, said: list[Estimate], stamps: list[int], truth: dict[int, dict[str, Pose]], end: int
) -> None:
    off = [subtract(e.motion.position, _between(stamps, truth, e.stamp)) for e in said]
    late = [norm(v) for e, v in zip(said, off, strict=True) if e.stamp > end - SECOND]
    mean = [fmean(axis) for axis in zip(*off, strict=True)]
    watched.observations[owner] = max(late, default=inf)
    watched.noises[owner] = sqrt(fmean(dist(v, mean) ** 2 for v in off)) if off else inf


def _between(stamps: list[int], truth: dict[int, dict[str, Pose]], stamp: int) -> Vector:
    """Return where the leader was at `stamp`: between the two nearest exposures, straight on."""
    k = bisect_right(stamps, stamp)
    a, b = truth[stamps[k - 1]]["uav0"], truth[stamps[min(k, len(stamps) - 1)]]["uav0"]
    return add(a.position, scale(subtract(b.position, a.position), (stamp - a.stamp) / max(b.stamp - a.stamp, 1)))


def _look(watched: Watched, swarm: Swarm, poses: dict[str, Pose], before: dict[str, Pose]) -> None:
    places = {owner: pose.position for owner, pose in poses.items()}
    owners = sorted(places)
    for k, one in enumerate(owners):
        for other in owners[:k]:
            watched.closest = min(watched.closest, dist(places[one], places[other]))
        if one == "uav0":
            continue
        x, y, z = places[one]
        watched.lowest = min(watched.lowest, z)
        for obstacle in swarm.obstacles:
            gap = hypot(x - obstacle.center[0], y - obstacle.center[1]) - obstacle.radius
            watched.obstacle = min(watched.obstacle, gap)
        fence = swarm.limits.fence
        for p, low, high in zip(places[one], fence.low, fence.high, strict=True):
            watched.outside = max(watched.outside, low - p, p - high)
        if one in before:
            dt = (poses[one].stamp - before[one].stamp) / SECOND
            watched.fastest = max(watched.fastest, dist(places[one], before[one].position) / dt)


def _judge(watched: Watched, swarm: Swarm, poses: dict[str, Pose], t: float) -> None:
    formation, leader = swarm.build_formation(), poses["uav0"].position
    worst = max(
        dist(poses[f"uav{i}"].position, [p + h for p, h in zip(leader, formation.offset(k, t), strict=True)])
        for k, i in enumerate(swarm.followers)
    )
    watched.error = worst if watched.error == inf else max(watched.error, worst)


@pytest.fixture(scope="session")
def fly_flock() -> Callable[..., Watched]:
    """Fly a small swarm round a leader that rests (or as `changes` say)."""

    def fly(
        starts: list[list[float]], offsets: dict[int, list[float]], changes: dict[str, Any] | None = None,
        duration: float = 8.0,
    ) -> Watched:  # fmt: skip
        return watch(flock(starts, offsets, changes or {}), duration)

    return fly


@pytest.fixture(scope="session")
def watch_swarm() -> Callable[..., Watched]:
    """Watch a swarm in virtual time."""
    return watch
