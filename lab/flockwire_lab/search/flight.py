"""One flight of a search, on any worker: flown, recorded, judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import sqrt
from typing import Literal

from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.loading import parse_swarm
from flockwire_core.process.driving import GRAVITY
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import CONSOLE

from flockwire_lab.coverage import events
from flockwire_lab.faults.kinds import AirframeFailure, ClockStep, Visitor
from flockwire_lab.search.events import EventInjector, SecondStation, parse_events
from flockwire_lab.search.formation import tails
from flockwire_lab.search.liveness import Recovery
from flockwire_lab.search.margin import BOUNDS, Bounds, Flown, Margin
from flockwire_lab.search.record import Recorder
from flockwire_lab.search.robustness import margins
from flockwire_lab.study.variation import Table
from flockwire_lab.world import EPOCH, World

Mode = Literal["safety", "liveness"]
USUAL = {"distance": 2.0, "clearance": 2.0, "contact": 0.3, "rung": 0.23}  # margins where all is well; 1 of the others
OVERTIME = SECOND  # ns after the longest flight, at which one that is not over is cut off


@dataclass(frozen=True, slots=True)
class Case:
    """A flight: the swarm file's and the file of faults' content, the seed, `duration` s up to the order to land."""

    table: Table
    faults: list[Table]
    seed: int
    duration: float
    mode: Mode = "safety"


@dataclass(frozen=True, slots=True)
class Judged:
    """What a flight showed: margins by property, reactions with the s after the order to take off, why it failed."""

    margins: dict[str, Margin]
    reactions: dict[str, float] = field(default_factory=dict)
    failure: str = ""
    seconds: float = 0.0
    world_ended: bool = False
    refused: str = ""  # why the case is not a flight
    cell: tuple[str, str, str] = ("", "", "")  # of the least margin: last reaction, last fault, phase
    events: dict[str, int] = field(default_factory=dict)  # how often each happened (coverage.py)

    @property
    def violations(self) -> list[str]:
        """The violated properties, in words."""
        return [
            f"{name}: {margin.what} at {margin.at:.2f} s" for name, margin in self.margins.items() if margin.violated
        ]


def scaled(judged: Judged) -> float:
    """Return the least margin, each relative to that of a flight without faults."""
    return min(margin.value / USUAL.get(name, 1.0) for name, margin in judged.margins.items())


def worst_of(found: Mapping[int, Judged]) -> dict[str, int]:
    """Return the number of the flight with the least margin of each property."""
    worst: dict[str, int] = {}
    for number, judged in sorted(found.items()):
        for name, margin in judged.margins.items():
            if name not in worst or margin.value < found[worst[name]].margins[name].value:
                worst[name] = number
    return worst


class Flight:
    """The flight of a case; `say` takes what happens, line by line. Raises InputError for a case that is refused."""

    def __init__(self, case: Case, say: Callable[[str], None] | None = None) -> None:
        swarm = parse_swarm(case.table, "the swarm of the search")
        plan = Plan(swarm.in_simulation())
        faults, events = parse_events(case.faults, plan, "the faults of the search")
        self.recorder = Recorder(plan, say)
        kinds = {type(one) for one in (*faults, *events)}
        self._visited, self._quiet = Visitor in kinds, not kinds
        self._shared = SecondStation in kinds  # who may end a landing
        stations = (CONSOLE.kind,) if self._shared else ()
        self.world = World(swarm, case.seed, case.duration, faults, self.recorder.take, stations=stations)
        self._injector = EventInjector(self.world, events, faults, self.recorder)
        moving = self._injector.moving  # an airframe fails by the clock of its process
        early = sum(max(f.step, 0.0) for f in faults if isinstance(f, ClockStep) and f.process in moving)
        self._fails = {uav(f.drone): f.at - early for f in reversed(faults) if isinstance(f, AirframeFailure)}
        self._recovery = Recovery(self.world, self.recorder, faults) if case.mode == "liveness" else None

    def fly(self, bounds: Bounds = BOUNDS) -> Flown:
        """Fly it to its end."""
        world, recorder, scheduler = self.world, self.recorder, self.world.scheduler
        cut_off = EPOCH + nanoseconds(bounds.longest) + OVERTIME
        scheduler.at(cut_off, lambda _: scheduler.stop())
        if self._recovery is not None:
            self._recovery.begin()
            scheduler.run(cut_off)
            failure = ""
        else:
            failure = world.run().failure
        end = scheduler.now
        if recorder.stopped is not None or self._fails:  # it is over when all motors are off: let the drones fall
            scheduler.run(end + fall_time(world.swarm))
        if self._shared and not recorder.all_down():  # `up` ends the processes that it started
            self._injector.retire()
            scheduler.run(cut_off)
            end = scheduler.now
        return recorder.flown(
            end,
            failure,
            fails=self._fails,
            world_ended=self._injector.world_ended
            or self._injector.frozen(recorder.seconds(end), recorder.seconds(scheduler.now)),
            still=self._injector.still,
            jumps=self._injector.jumps,
            visited=self._visited,
            formed=(self._recovery.formed((end - EPOCH) / SECOND),) if self._recovery is not None else (),
            tails=tails(recorder, world.swarm) if self._quiet and not failure else {},
        )


def fall_time(swarm: Swarm) -> int:
    """Return a time, ns, that is longer than a fall from the fence's top takes."""
    return nanoseconds(1.0 + sqrt(2.0 * max(swarm.limits.fence.high[2], 0.0) / GRAVITY))


def fly(case: Case, say: Callable[[str], None] | None = None, bounds: Bounds = BOUNDS) -> Judged:
    """Fly and judge a case; what cannot be flown is refused."""
    try:
        flight = Flight(case, say)
    except InputError as error:
        return Judged({}, refused=str(error).replace("\n", "; "))
    return judge(flight.fly(bounds), flight.recorder, case.faults, bounds)


Order = tuple[int, Case]


def fly_numbered(order: Order) -> tuple[int, Judged]:
    """Fly one case, on any worker; it raises nothing: an error in a flight is a violation."""
    number, case = order
    try:
        return number, fly(case)
    except Exception as error:  # a user's law may raise anything
        failure = f"{type(error).__name__}: {error}"
        return number, Judged({"error": Margin(-1.0, 0.0, "", failure)}, failure=failure)


def judge(flown: Flown, recorder: Recorder, faults: list[Table], bounds: Bounds = BOUNDS) -> Judged:
    """Return the margins of a flight under `faults`, and the cell of its least one."""
    found = margins(flown, bounds)
    least = min(found.values(), key=lambda margin: margin.value)
    reaction = next((name for name, at in reversed(recorder.reactions.items()) if at <= least.at), "")
    fault = next((one["kind"] for one in sorted(faults, key=lambda one: -one["at"]) if one["at"] <= least.at), "")
    cell = (reaction, fault, _phase(flown, least))
    return Judged(
        found, dict(recorder.reactions), flown.failure, flown.seconds, flown.world_ended, cell=cell,
        events=events(recorder.protocol),
    )  # fmt: skip


def _phase(flown: Flown, margin: Margin) -> str:
    """Return the phase that the pilot of the margin's drone reported before it."""
    reports = flown.reports.get(margin.who)
    if reports is None:
        return ""
    return next((p for t, p in zip(reports.times[::-1], reversed(reports.phases), strict=True) if t <= margin.at), "")
