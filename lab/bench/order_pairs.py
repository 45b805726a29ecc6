"""Two stations give an order each, in virtual time: every pair of orders, in every situation, on slow networks.

A draw has the time between the two orders (up to 3 s), what each station's messages take there (up to 3 s; for half of
the draws a hundredth of a second) and back (up to 1 s); the stations' clocks are 0.2 s apart. The swarm is judged when
all has come to rest, by the rules of docs/safety.md: what goes down holds, and what takes up holds only where its giver
knew what it ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from random import Random

from flockwire_core.domain.order import Answer, Mission, Order, Version
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status
from flockwire_lab.network import Conditions
from flockwire_lab.process import Published
from flockwire_lab.virtual_time import LocalClock
from flockwire_lab.world import EPOCH, World

VERBS = ("start", "formation", "hold", "land", "stop")
SITUATIONS = ("on the ground", "in take-off", "in the air")
STATIONS = ("operator", "console")
BEGIN = {"on the ground": 3.0, "in take-off": 4.3, "in the air": 12.0}  # s, when the first order is given
ASKED = 3.0  # s, when the drones are sent up where they are to fly
REST = 24.0  # s after the second order, when all has come to rest
QUIET = 4.0  # s, longer than a message takes: what has not changed for so long after the last answer is at rest
ON_GROUND = (Phase.GROUNDED, Phase.READY)


def swarm() -> Swarm:
    """Return a swarm of three that steps twenty times a second."""
    starts = ((0.0, 0.0), (1.5, 0.0), (-1.5, 0.6))
    return parse_swarm({
        "name": "pairs",
        "control": {"rate_hz": 20},
        "gateway": {"rate_hz": 20},
        "limits": {"speed": 1.0, "fence": {"min": [-20.0, -20.0, -0.5], "max": [20.0, 20.0, 4.0]}},
        "formation": {"kind": "circle", "radius": 1.5, "rate": 0.2},
        "formations": {"wide": {"kind": "circle", "radius": 2.0, "rate": 0.2}},
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}},
        "graph": {"edges": [[0, 1], [0, 2]]},
        "drones": [{"id": i, "start": [x, y, 0.0]} for i, (x, y) in enumerate(starts)],
    }, "pairs")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Two orders, the situation in which they are given, and the seed of what is drawn."""

    first: str
    second: str
    situation: str
    seed: int

    @property
    def draw(self) -> tuple[float, tuple[float, float], tuple[float, float], tuple[float, float]]:
        """Return s between the orders, and of the stations delays there, delays back and clocks' offsets, s."""
        chance = Random(f"{self.first} {self.second} {self.situation} {self.seed}")
        gap, there = chance.uniform(0.02, 3.0), (chance.uniform(0.0, 3.0), chance.uniform(0.0, 3.0))
        if self.seed % 2:  # half of them on a usual network
            there = (there[0] / 300.0, there[1] / 300.0)
        back = (min(there[0], 1.0), min(there[1], 1.0))
        offset = chance.choice((-0.1, 0.1))
        return gap, there, back, (offset, -offset)


@dataclass
class Seen:
    """What the pilots reported last, and which orders were given."""

    reports: dict[str, Report] = field(default_factory=dict)
    given: dict[int, set[Version]] = field(default_factory=dict)  # by station's number: the orders that it published
    changed: int = 0  # when a phase or an order that holds changed last, Unix ns

    def take(self, published: Published) -> None:
        """Take one message."""
        if published.key.kind not in ("status", "mission", "proposal"):
            return
        match published.message:
            case Status(stamp=stamp, identity=identity, report=report):
                was, self.reports[identity] = self.reports.get(identity), report
                if was is None or (was.phase, was.mission, was.unnumbered) != (
                    report.phase,
                    report.mission,
                    report.unnumbered,
                ):
                    self.changed = stamp
            case Mission() as mission:
                self.given.setdefault(mission.giver >> 16, set()).add(mission.version)


@dataclass(frozen=True)
class Outcome:
    """How a case ended: what is wrong with it (empty: nothing), and what the stations were answered."""

    case: Case
    wrong: str
    answers: tuple[Answer | None, ...]
    phases: tuple[str, ...]


def fly(case: Case) -> Outcome:
    """Fly one case."""
    gap, there, back, clocks = case.draw
    seen = Seen()
    world = World(swarm(), case.seed, 0.0, (), seen.take, stations=STATIONS[1:])
    world.conduct(None)
    chance = Random(case.seed)
    for name, out, home, clock in zip(STATIONS, there, back, clocks, strict=True):
        world.processes[name].clock = LocalClock(EPOCH, nanoseconds(clock))
        for (sender, receiver), link in world.links.items():
            if name in (sender, receiver):  # each drone has links of its own: orders cross on the way to some
                link.disturb(Conditions((out if sender == name else home) * chance.uniform(0.7, 1.0)))
    begin = BEGIN[case.situation] + 2.0 * (there[0] + back[0] + 1.0 if case.situation != "on the ground" else 0.0)
    if case.situation != "on the ground":
        _at(world, ASKED, "operator", "start")
        if case.situation == "in take-off":
            begin = ASKED + there[0] + back[0] + 0.7
    _at(world, begin, "operator", case.first)
    _at(world, begin + gap, "console", case.second)
    _rest(world, seen, EPOCH + nanoseconds(begin + gap), 2 if case.situation == "on the ground" else 3)
    pilots = tuple(world.plan.pilots.values())
    answers = tuple(world.station(name).answers[-1][1] if world.station(name).answers else None for name in STATIONS)
    return Outcome(
        case,
        _wrong(case, seen, pilots, answers, EPOCH + nanoseconds(begin - 0.2)),
        answers,
        tuple(seen.reports[p].phase for p in pilots),
    )


def _rest(world: World, seen: Seen, since: int, orders: int) -> None:
    """Fly on from `since` (Unix ns) until all `orders` are answered and nothing changes, for REST at most."""
    world.scheduler.run(since)
    while world.scheduler.now < since + nanoseconds(REST):
        world.scheduler.run(world.scheduler.now + SECOND)
        answered = sum(len(world.station(name).answers) for name in STATIONS)
        moving = any(report.phase in (Phase.TAKEOFF, Phase.LANDING) for report in seen.reports.values())
        if answered == orders and not moving and world.scheduler.now - seen.changed > nanoseconds(QUIET):
            return


def _at(world: World, seconds: float, station: str, verb: str) -> None:
    order = Order(verb, "wide" if verb == "formation" else "")
    world.scheduler.at(EPOCH + nanoseconds(seconds), lambda _: world.station(station).ask(order))


def _wrong(case: Case, seen: Seen, pilots: tuple[str, ...], answers: tuple[Answer | None, ...], begin: int) -> str:
    """Return what is not as docs/safety.md has it, empty when nothing is."""
    reports = [seen.reports[pilot] for pilot in pilots]
    phases = [report.phase for report in reports]
    if "stop" in (case.first, case.second):
        return "" if all(phase == Phase.STOPPED for phase in phases) else f"after a stop: {phases}"
    if None in answers:
        return "an order was not answered"
    missions = [report.mission for report in reports]
    if len({mission.version if mission else None for mission in missions}) > 1 and not _same_effect(missions):
        return f"they obey different orders: {[mission.verb if mission else None for mission in missions]}"
    holding = next((mission for mission in missions if mission is not None), None)
    if holding is not None and case.first in ("hold", "land") and holding.verb in ("takeoff", "start", "formation"):
        newest = {(stamp, giver) for stamp, giver in seen.given.get(1, set()) if stamp >= begin}
        if not newest.intersection(holding.downs):
            return f"{holding.verb} holds, which was made without knowledge of {case.first}"
    return _not_held(case, phases) or _dishonest(case, phases, answers)


def _not_held(case: Case, phases: list[str]) -> str:
    """Return which order to come down was not obeyed in the end, though nothing was made from it."""
    landed = all(phase in ON_GROUND for phase in phases)
    if not landed and (case.second == "land" or (case.first == "land" and case.second != "start")):
        return f"a landing was taken back: {phases}"
    if case.second == "hold" and any(phase in (Phase.FORMATION, Phase.TAKEOFF) for phase in phases):
        return f"a hold was taken back: {phases}"
    return ""


def _same_effect(missions: list[Mission | None]) -> bool:
    """Return whether all are down orders of one verb: two landings at once are one."""
    return len({mission.verb if mission is not None else "" for mission in missions}) == 1 and all(
        mission is not None and mission.verb in ("hold", "land") for mission in missions
    )


def _dishonest(case: Case, phases: list[str], answers: tuple[Answer | None, ...]) -> str:
    """Return what is wrong with an answer: confirmed by all, and not so though nothing ended it."""
    for answer, verb in zip(answers, (case.first, case.second), strict=True):
        if answer is None or answer.refusal or answer.missing or not answer.confirmed:
            continue
        on_ground = [phase in ON_GROUND for phase in phases]
        if verb == "land" and case.second != "start" and not all(on_ground):
            return f"a landing was confirmed: {phases}"
        if verb == "start" and case.first == case.second and any(on_ground):
            return f"a start was confirmed: {phases}"
    return ""


CASES = tuple(product(VERBS, VERBS, SITUATIONS))


def case_of(number: int) -> Case:
    """Return case `number`: all pairs in all situations, then all with another draw."""
    draw, place = divmod(number, len(CASES))
    return Case(*CASES[place], draw)
