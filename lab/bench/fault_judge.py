"""Flies one drawn flight in virtual time, and judges it by the margins of flockwire_lab.search."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

from fault_draws import DURATION, Drawn, drawn
from fault_injector import Injector
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import nanoseconds
from flockwire_core.pilot.wanted import CROWDED
from flockwire_core.swarm.model import uav
from flockwire_core.wire.processes import CONSOLE
from flockwire_lab.process import Published
from flockwire_lab.search.events import SECOND_STATION
from flockwire_lab.search.flight import OVERTIME, fall_time, judge
from flockwire_lab.search.margin import BOUNDS, Bounds, Flown
from flockwire_lab.search.record import Recorder
from flockwire_lab.search.robustness import pairs_in_the_air
from flockwire_lab.world import EPOCH, World
from rare_draws import APART, HAND, ORDERS, UPLINK
from rare_swarms import SIDE

LOOKING = 30.0  # s for which a landing may look for a free place in a room with hardly one
DISTANCES = ("distance:", "clearance:")  # law "paper", without a safety filter, promises none (docs/study.md)
NO_PLACE = f"pilot: landing, {CROWDED.code}"
UNOWED = {  # a hand still holds it; it obeys its last command; it is elsewhere until its pilot knows (docs/safety.md)
    HAND: ("down",), UPLINK: ("fence", "clearance"), APART: ("distance", "clearance", "fence"), "swap": ("fence",),
}  # fmt: skip


def nearest(flown: Flown, falls: bool) -> float:
    """Return the smallest distance of two drones in the air, m, of which one falls, or neither."""
    closest = (float(gaps[fall == falls].min(initial=inf)) for *_, gaps, fall in pairs_in_the_air(flown))
    return min(closest, default=inf)


@dataclass
class Result:
    """What became of one flight; distances in m, times in s after the order to take off."""

    seed: int
    variant: str
    usual: bool
    faults: list[dict[str, Any]]
    failure: str = ""
    seconds: float = 0.0
    closest: float = inf
    struck: float = inf  # between a drone that falls and another
    fastest_contact: float = 0.0  # m/s
    world_ended: bool = False
    bad: list[str] = field(default_factory=list)
    unpromised: list[str] = field(default_factory=list)  # what is not bad because the law does not promise it
    reactions: dict[str, float] = field(default_factory=dict)  # when each was first reached
    events: dict[str, int] = field(default_factory=dict)  # how often each happened
    margins: dict[str, float] = field(default_factory=dict)  # of each property, as a share of its bound

    @property
    def outcome(self) -> str:
        """Return the column of the table."""
        if self.bad:
            return "bad"
        if self.world_ended:
            return "world ended"
        if self.unpromised:
            return "near"
        if self.struck < BOUNDS.collision:
            return "struck by a fall"
        return "landed early" if self.failure else "flew on"


class Judge:
    """Flies one flight, and judges it by what is published."""

    def __init__(self, flight: Drawn, say: Callable[[str], None] | None = None, bounds: Bounds = BOUNDS) -> None:
        self.flight, self._bounds = flight, bounds
        kinds = {fault["kind"] for fault in flight.faults}
        self._visited = "visitor" in kinds
        stations = (CONSOLE.kind,) if {SECOND_STATION, ORDERS} & kinds else ()
        self.world = World(
            flight.swarm, flight.seed, DURATION, flight.parsed()[0], self.take, flight.without, stations, flight.rare
        )
        self._recorder = Recorder(self.world.plan, say)
        self._injector = Injector(flight, self.world, self._recorder)
        failures = [fault for fault in flight.faults if fault["kind"] == "failure"]
        self._fails = {uav(fault["drone"]): fault["at"] for fault in reversed(failures)}

    def fly(self) -> Result:
        """Fly, judge the end too."""
        flight, recorder, injector, scheduler = self.flight, self._recorder, self._injector, self.world.scheduler
        scheduler.at(EPOCH + nanoseconds(self._bounds.longest) + OVERTIME, lambda _: scheduler.stop())
        injector.start()
        outcome = self.world.run()
        injector.end()
        if recorder.stopped is not None:  # the flight is over when all motors are off: let the drones fall
            scheduler.run(scheduler.now + fall_time(flight.swarm))
        flown = recorder.flown(
            EPOCH + nanoseconds(outcome.seconds), outcome.failure, fails=self._fails, world_ended=injector.world_ended,
            still=(), jumps=(), formed=(), tails={}, visited=self._visited,
        )  # fmt: skip
        judged = judge(flown, recorder, list(flight.faults), self._bounds)
        contact, bad = judged.margins.get("contact"), judged.violations
        if NO_PLACE in judged.events:  # a drone without a place to land hovers, and the director says so
            bad = [what for what in bad if not what.startswith(("down:", "over:", "landing:"))]
        for name, owner in self._unowed():
            if name in judged.margins and owner in (judged.margins[name].who, *judged.margins[name].what.split()):
                bad = [what for what in bad if not what.startswith(f"{name}:")]
        filtered = flight.swarm.control.filtered
        unpromised = [what for what in bad if not filtered and what.startswith(DISTANCES)]
        fastest = flight.swarm.limits.vertical_speed + self._bounds.hard
        return Result(
            flight.seed, flight.variant, flight.usual, list(flight.faults), outcome.failure, outcome.seconds,
            nearest(flown, falls=False), nearest(flown, falls=True),
            0.0 if contact is None else (1.0 - contact.value) * fastest,
            injector.world_ended, [what for what in bad if what not in unpromised], unpromised, judged.reactions,
            judged.events,
            {name: round(margin.value, 4) for name, margin in judged.margins.items()},
        )  # fmt: skip

    def _unowed(self) -> Iterator[tuple[str, str]]:
        """Yield the properties that faults excuse, each with the drone that it excuses."""
        for fault in self.flight.faults:
            for name in UNOWED.get(fault["kind"], ()):
                for drone in fault.get("drones") or [fault["drone"]]:
                    yield name, uav(drone)

    def take(self, published: Published) -> None:
        """Receive what is published."""
        self._recorder.take(published)
        if published.key.kind == "mission" and isinstance(order := published.message, Mission):
            self._injector.ordered(order.verb)


def fly(seed: int, say: Callable[[str], None] | None = None, bounds: Bounds = BOUNDS) -> Result:
    """Fly the flight of `seed`; `say` takes what happens, line by line."""
    return Judge(drawn(seed), say, bounds).fly()


def fly_rare(seed: int, say: Callable[[str], None] | None = None) -> Result:
    """Fly the flight of `seed` with what the family "rare faults" adds.

    A stop waits for a closed link, and for a late message, a landing for a place where there is hardly one.
    """
    flight, waits = drawn(seed, rare=True), 0.0
    landing = LOOKING if flight.swarm.limits.fence.high[0] <= 2.0 * SIDE else 0.0
    if (rare := flight.rare) is not None:
        waits = max(rare.closed_for * bool(rare.closed_links), rare.late_by * bool(rare.late_messages))
    return Judge(flight, say, replace(BOUNDS, stop=BOUNDS.stop + waits, landing=BOUNDS.landing + landing)).fly()
