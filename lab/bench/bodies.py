"""Poses that are not the drone's, in virtual time: whether it lands inside the fence, and whether none is missed.

Honest flights draw the airframe, a gain wrong by 30 % and a lag wrong by 60 % that no pilot knows (of multirotors also
the model, a mass wrong by 15 %, gains of the autopilot wrong by 30 %), wind, gusts and downwash, noise, latency, law
and speeds; none may refuse its poses for longer than a moment. Each kind of lie is flown
with drawn swarms, from a drawn time on, for 3 s or until the end. A row: how far the worst drone was outside the fence
and how near two in the air came to one another from then on, m. It is bad if an honest pilot takes its body for
another, a lie is missed, or a drone is 0.5 m outside or nearer than 0.2 m to another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import cos, dist, inf, pi, sin
from random import Random
from typing import Any

import flockwire_mocap.core as gateway
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose, product
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add
from flockwire_core.loading import parse_swarm
from flockwire_core.process.cores import Start
from flockwire_core.swarm.airframes import MULTIROTOR
from flockwire_core.swarm.drones import Airframe
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import APART, Status
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.world import World
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_twins.multirotor.swarm_file import MODELS
from flockwire_twins.trackers.cameras import SimulatedSource

FENCE, MARGIN, COLLISION, AIR = 3.5, 0.5, 0.2, 0.15  # m; a drone above AIR flies
HARMLESS = 0.1  # m, of a frozen pose from the truth: a drone that hovers, and was not commanded to move
DURATION = 10.0  # s
ABOUT = (0.0, 0.0, 1.0, 0.0)  # a turn by 180 degrees about z


class Lie:
    """One lie about the body of `drone`, from `at` s after the order to take off on, for `lasts` s."""

    def __init__(self, kind: str, drones: list[int], at: float, lasts: float, angle: float) -> None:
        self.kind, self.drone, self.other = kind, drones[0], drones[1]
        self.at, self.lasts, self.angle = at, lasts, angle
        self._first: dict[int, ReportedBody] = {}  # as they were when it began

    def bodies(self, bodies: tuple[ReportedBody, ...], t: float) -> list[ReportedBody]:
        """Return what the tracker reports instead of `bodies`, `t` s after its beginning."""
        for body in bodies:
            self._first.setdefault(body.identity, body)
        places = {body.identity: body for body in bodies}
        return [self._told(body, places, t) for body in bodies]

    def _told(self, body: ReportedBody, now: Mapping[int, ReportedBody], t: float) -> ReportedBody:
        x, y, z = body.position
        if self.kind == "frame":  # defined again: turned by 90 degrees and moved
            return put(body, (1.0 - y, x - 0.5, z))
        if self.kind == "axes":
            return put(body, (x, z, y))
        if self.kind == "swap" and body.identity == self.other:
            return put(body, now[self.drone].position) if self.drone in now else body
        if body.identity != self.drone:
            return body
        away = (cos(self.angle), sin(self.angle), 0.0)
        hand = add(self._first[body.identity].position, (1.2 * away[0], 1.2 * away[1], 0.1))
        other = now.get(self.other, body).position
        lies: dict[str, Callable[[], ReportedBody]] = {
            "zero": lambda: put(body, (0.0, 0.0, 0.0)),
            "far": lambda: put(body, (9999.99, 9999.99, 9999.99)),
            "moved": lambda: put(body, add(body.position, (1.5 * away[0], 1.5 * away[1], 0.0))),
            "wand": lambda: put(body, add(hand, (0.4 * sin(2.0 * t), 0.3 * sin(1.3 * t), 0.1 * sin(t)))),
            "frozen": lambda: put(body, self._first[body.identity].position),
            "turned": lambda: body._replace(orientation=product(ABOUT, body.orientation)),
            "swap": lambda: put(body, other),
            "stuck": lambda: put(body, other),
        }
        return lies[self.kind]()


KINDS = ("zero", "far", "moved", "wand", "frozen", "turned", "swap", "stuck", "frame", "axes")


def put(body: ReportedBody, position: Vector) -> ReportedBody:
    """Return `body` at another position, m."""
    return body._replace(position=position)


class LyingSource:
    """The simulated cameras, with a lie."""

    def __init__(self, start: Start, lie: Lie) -> None:
        self._source, self._lie, self._took_off = SimulatedSource(start), lie, 0
        self.triggers, self.state = self._source.triggers, self._source.state
        self.complete = self._source.complete

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a truth, or the order to take off."""
        self._source.receive(key, message, now)
        if isinstance(message, Mission) and message.verb == "takeoff":
            self._took_off = self._took_off or message.stamp

    def take(self, now: int) -> list[TrackerFrame]:
        """Return the frames, some of them false."""
        frames, lie = self._source.take(now), self._lie
        told = list[TrackerFrame]()
        for frame in frames:
            t = (frame.captured - self._took_off) / SECOND - lie.at if self._took_off else -1.0
            bodies = tuple(lie.bodies(frame.bodies, t)) if 0.0 <= t < lie.lasts else frame.bodies
            told.append(TrackerFrame(frame.number, frame.captured, frame.transmitted, bodies, False))
        return told


class Watch:
    """What a flight shows: distances of drones in the air from `at` s on, m; whose poses were found false, when, s."""

    def __init__(self, swarm: Swarm, at: float) -> None:
        self.outside, self.nearest = -inf, inf
        self.apart: dict[str, tuple[float, str]] = {}
        self.refused: dict[str, int] = {}
        self._room, self._at, self._began = swarm.limits.fence.room(), at, 0
        self.places: dict[str, Vector] = {}
        self.false: dict[str, float] = {}  # m, largest distance of a pose from the truth

    def take(self, published: Published) -> None:
        """Look at a message."""
        message: Any = published.message
        if isinstance(message, Mission):
            self._began = self._began or published.at
        t = (published.at - self._began) / SECOND if self._began else -1.0
        if isinstance(message, Pose) and published.key.kind == "truth":
            self.places[published.key.owner] = message.position
            if t >= self._at:
                flying = {owner: place for owner, place in self.places.items() if place[2] > AIR}
                self.outside = max([self.outside, *map(self._room.outside, flying.values())])
                owner, place = published.key.owner, message.position
                if owner in flying:
                    gaps = [dist(place, other) for one, other in flying.items() if one != owner]
                    self.nearest = min([self.nearest, *gaps])
        elif isinstance(message, Pose) and published.key.owner in self.places:
            off = dist(message.position, self.places[published.key.owner])
            self.false[published.key.owner] = max(off, self.false.get(published.key.owner, 0.0))
        elif isinstance(message, Status):
            for reason in message.report.reasons:
                if reason.code == APART:
                    self.apart.setdefault(message.identity, (round(t, 2), reason.text))
            for name, count in message.report.counts:
                if name == "poses refused":
                    self.refused[message.identity] = count


def swarm_of(chance: Random, airframe: str, honest: bool) -> tuple[Swarm, list[dict[str, Any]]]:
    """Return a drawn swarm of five, and the faults of its airframes and weather."""
    speed = chance.choice([1.0, 1.5, 3.0] if airframe == "tello" else [1.5, 3.0])
    latency = round(chance.choice([0.0, 0.01, chance.uniform(0.0, 0.1)]), 3) if honest else 0.01
    lag, dead = chance.choice([(0.05, 0.0), (0.2, 0.05), (0.3, 0.1)])
    wind = chance.uniform(0.0, 1.5) if honest else 0.0
    angle, rest = chance.uniform(0.0, 2.0 * pi), chance.random()
    noise = chance.choice([0.0, 0.001])
    law = "paper" if honest and chance.random() < 0.3 else "extended"
    table: dict[str, Any] = {
        "name": "bodies",
        "formation": {"kind": "circle", "radius": 1.2, "rate": chance.choice([0.0001, 0.2, 0.5])},
        "leader": {
            "trajectory": {"kind": "constant", "velocity": [0.1, 0.05, 0.0]}
            if honest
            else {"kind": "constant", "velocity": [0.0, 0.0, 0.0]},
        },
        "graph": {"edges": [[0, 1], [0, 2], [1, 3], [2, 4]]},
        "control": {"law": law, "rate_hz": 50},
        "gateway": {"rate_hz": 50, "noise": noise, "latency": latency},
        "limits": {
            "speed": speed,
            "fence": {"min": [-FENCE, -FENCE, -0.5], "max": [FENCE, FENCE, 3.0]},
            "staleness": {"pose_zero": 0.1 + latency, "nearby_slow": 0.1 + latency},
        },
        "airframes": {airframe: {"gain": chance.uniform(0.7, 1.3) if honest else 1.0}},
        "drones": [{"id": 0, "start": [0.0, 0.0, 0.0], "airframe": airframe}],
    }
    if airframe == "kinematics":
        table["airframes"][airframe] |= {"lag": lag, "dead_time": dead}
    if airframe == "multirotor":  # its lag is its own, so the swarm file's is wrong
        table["airframes"][airframe] |= {
            "model": chance.choice(sorted(MODELS)),
            "rotors": chance.random() < 0.3,
            "lag": MULTIROTOR.built_in["lag"] / chance.uniform(0.4, 1.6),
        }
    for i in range(1, 5):
        a = pi / 2.0 * i
        start = [round(1.2 * cos(a), 3), round(1.2 * sin(a), 3), 0.0]
        table["drones"].append({"id": i, "start": start, "airframe": airframe})
    if honest:
        table["limits"]["fence"] = {"min": [-12.0, -12.0, -0.5], "max": [12.0, 12.0, 4.0]}
        if wind < 0.9 * speed and chance.random() < 0.5:
            table["control"]["disturbance"] = min(1.5, 0.9 * speed)
        table["wind"] = {
            "velocity": [wind * rest * cos(angle), wind * rest * sin(angle), 0.0],
            "gust": wind * (1 - rest),
        }
    swarm = parse_swarm(table, "bodies")
    faults: list[dict[str, Any]] = []
    if honest:
        faults += [{"at": 0.0, "drone": i} | _unknown(chance, swarm.airframe(i), airframe) for i in range(5)]
        for _ in range(3):  # gusts of others' downwash: 0.3 to 1 s, downwards and to a side
            at, down = chance.uniform(1.0, 10.0), chance.uniform(0.3, 1.2)
            side = [chance.uniform(-0.5, 0.5), chance.uniform(-0.5, 0.5), -down]
            faults.append({"at": at, "kind": "wind", "velocity": side, "duration": chance.uniform(0.3, 1.0)})
    return swarm, sorted(faults, key=lambda fault: float(fault["at"]))


def _unknown(chance: Random, known: Airframe, airframe: str) -> dict[str, Any]:
    """Return the fault by which an airframe differs from what the swarm file says of it."""
    if airframe == "multirotor":
        return {"kind": "wear", "mass": chance.uniform(0.85, 1.15), "gains": chance.uniform(0.7, 1.3)}
    return {"kind": "lag", "lag": known.lag * chance.uniform(0.4, 1.6), "dead_time": known.dead_time}


def fly_honest(seed: int, airframe: str = "") -> bool:
    """Fly once without a lie; returns whether no body was taken for another, and no poses were refused for 1 s."""
    chance = Random(f"honest {seed}")
    airframe = airframe or ("kinematics", "tello")[seed % 2]
    swarm, faults = swarm_of(chance, airframe, honest=True)
    watch = Watch(swarm, 0.0)
    outcome = World(swarm, seed, DURATION, parse_faults({"faults": faults}, Plan(swarm), "bench"), watch.take).run()
    well = not watch.apart and max(watch.refused.values(), default=0) < swarm.gateway.rate_hz
    if not well or watch.refused or seed % 100 == 99:
        print(
            f"honest {seed:4} {airframe:10} {watch.apart or ''} refused {watch.refused} {outcome.failure}", flush=True
        )
    return well


def lie_of(number: int) -> tuple[str, int]:
    """Return kind and seed of a lie: all kinds in turn."""
    seed, place = divmod(number, len(KINDS))
    return KINDS[place], seed


def fly_lie(kind: str, seed: int) -> tuple[Watch, bool]:
    """Fly once with a lie and print a row; returns what it showed, and whether it was well."""
    chance = Random(f"{kind} {seed}")
    airframe = "tello" if kind == "turned" else ("kinematics", "tello")[seed % 2]
    swarm, faults = swarm_of(chance, airframe, honest=False)
    drones = chance.sample(list(swarm.flying), 2)
    at, lasts = round(chance.uniform(4.5, 9.0), 3), chance.choice([3.0, 1000.0])
    lie = Lie(kind, drones, at, lasts, chance.uniform(0.0, 2.0 * pi))
    watch = Watch(swarm, at)
    sources: Any = gateway.SOURCES
    usual = sources["simulated"]
    globals()["make_lying_source"] = partial(LyingSource, lie=lie)
    sources["simulated"] = gateway.SourceRow(f"{__name__}:make_lying_source")
    try:
        outcome = World(swarm, seed, DURATION, parse_faults({"faults": faults}, Plan(swarm), "bench"), watch.take).run()
    finally:
        sources["simulated"] = usual
    pilot = Plan(swarm).pilot[lie.drone]
    found = watch.apart.get(pilot)
    if kind in ("frame", "axes") and watch.apart:  # a drone whose place stays is not wrong
        found = min(watch.apart.values())
    down = all(place[2] <= AIR for place in watch.places.values())
    harmless = kind == "frozen" and watch.false[uav(lie.drone)] < HARMLESS
    well = (found is not None or harmless) and down and watch.outside < MARGIN and watch.nearest >= COLLISION
    why = found[1][33:] if found else "harmless" if harmless else "MISSED"
    print(
        f"{kind:7} {seed:3} {airframe:10} {swarm.limits.speed:3.1f} m/s {pilot:6} at {at:5.2f}  "
        f"found {found[0] - at if found else inf:5.2f} s  outside {watch.outside:5.2f}  nearest {watch.nearest:5.2f}  "
        f"{'ok' if well else 'FAIL'}  {why}; {outcome.failure[:80]}",
        flush=True,
    )
    return watch, well
