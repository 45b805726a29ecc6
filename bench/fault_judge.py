"""Flies one drawn flight in virtual time, injects what the world does not, and judges it by flockwire_sim.search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any

from fault_draws import DURATION, Drawn, drawn
from flockwire.domain.marks import marked
from flockwire.domain.order import Mission
from flockwire.domain.time import SECOND, nanoseconds
from flockwire.ground.order import Order
from flockwire.swarm.model import uav
from flockwire.wire.processes import CONSOLE
from flockwire_sim.process import Published, VirtualProcess
from flockwire_sim.search.events import SECOND_STATION, WORLD_ENDED
from flockwire_sim.search.flight import FALL, judge
from flockwire_sim.search.record import Recorder
from flockwire_sim.search.robustness import BOUNDS, Bounds, closest
from flockwire_sim.world import EPOCH, World
from flockwire_tello.simulated.served import ServedTello
from rare_draws import CLOCK, EARLY, HAND, ORDERS, STATION_KILLED

AFTER = 2 * SECOND  # ns flown on after an order to a flight that is over
LANDING = 20  # s in which a landing after the flight must end


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
    rungs: dict[str, float] = field(default_factory=dict)  # when each was first reached
    marks: dict[str, int] = field(default_factory=dict)  # how often each was reached
    margins: dict[str, float] = field(default_factory=dict)  # of each property, as a share of its bound

    @property
    def outcome(self) -> str:
        """Return the column of the table."""
        if self.bad:
            return "bad"
        if self.world_ended:
            return "world ended"
        if self.struck < BOUNDS.collision:
            return "struck by a fall"
        return "landed early" if self.failure else "flew on"


class Judge:
    """Judges one flight by what is published, and injects what the world does not."""

    def __init__(self, flight: Drawn, say: Callable[[str], None] | None = None, bounds: Bounds = BOUNDS) -> None:
        self.flight, self._bounds = flight, bounds
        self.result = Result(flight.seed, flight.variant, flight.usual, list(flight.faults))
        kinds = {fault["kind"] for fault in flight.faults}
        stations = (CONSOLE.kind,) if {SECOND_STATION, ORDERS} & kinds else ()
        self.world = World(
            flight.swarm, flight.seed, DURATION, flight.of_world(), self.take, flight.without, stations, flight.rare
        )
        plan = self.world.plan
        self.recorder = Recorder(plan, self._begin, say)
        self._drivers = [self.world.processes[name] for name, row in plan.rows.items() if row.driver]
        self._published: set[str] = set()  # verbs of orders
        failures = [fault for fault in flight.faults if fault["kind"] == "failure"]
        self._fails = {uav(fault["drone"]): fault["at"] for fault in reversed(failures)}

    def fly(self) -> Result:
        """Fly, judge the end too."""
        result, recorder, scheduler = self.result, self.recorder, self.world.scheduler
        scheduler.at(EPOCH + nanoseconds(self._bounds.longest), lambda _: scheduler.stop())
        for fault in self.flight.faults:
            if fault["kind"] in (EARLY, HAND) or fault.get("on") == "":
                self._later(fault["at"], lambda fault=fault: self._inject(fault))
        with marked() as result.marks:
            outcome = self.world.run()
            if self.flight.after:
                self._order("operator", self.flight.after)
                scheduler.run(scheduler.now + AFTER)
            if any(fault["kind"] == ORDERS and fault["station"] == CONSOLE.kind for fault in self.flight.faults):
                self._land_again()
            if recorder.was_stopped:  # the flight is over when all motors are off: let the drones fall
                scheduler.run(scheduler.now + FALL)
        flown = recorder.flown(
            EPOCH + nanoseconds(outcome.seconds), outcome.failure, fails=self._fails, world_ended=result.world_ended,
            formed=(), tails={},
        )  # fmt: skip
        judged = judge(flown, recorder, list(self.flight.faults), self._bounds)
        result.failure, result.seconds, result.rungs = outcome.failure, outcome.seconds, judged.rungs
        result.closest, result.struck = closest(flown), closest(flown, falls=True)
        if (contact := judged.margins.get("contact")) is not None:
            fastest = self.flight.swarm.limits.vertical_speed + self._bounds.hard
            result.fastest_contact = (1.0 - contact.value) * fastest
        result.margins = {name: round(margin.value, 4) for name, margin in judged.margins.items()}
        result.bad += judged.violations
        return result

    def take(self, published: Published) -> None:
        """Receive what is published."""
        self.recorder.take(published)
        if published.key.kind == "mission":
            opened = published.sample.opened()
            assert opened is not None
            assert isinstance(opened[0], Mission)
            self._ordered(opened[0].verb)

    def _begin(self) -> None:
        for fault in self.flight.faults:
            if fault["kind"] not in (EARLY, HAND, ORDERS):
                self._later(fault["at"], lambda fault=fault: self._inject(fault))

    def _ordered(self, verb: str) -> None:
        """Inject what waits for the first order of a kind."""
        if verb not in self._published:
            self._published.add(verb)
            for fault in self.flight.faults:
                if fault.get("on") == verb:
                    self._later(fault["at"], lambda fault=fault: self._inject(fault))

    def _inject(self, fault: dict[str, Any]) -> None:
        processes, kind = self.world.processes, fault["kind"]
        self.recorder.tell(f"fault: {fault}")
        if kind == "stop":
            self.world.stop("bench")
        elif kind == SECOND_STATION:
            self._give(CONSOLE.kind, fault["orders"])
        elif kind == ORDERS:
            self._give(fault["station"], fault["orders"])
        elif kind == CLOCK:
            processes[CONSOLE.kind].clock.step(nanoseconds(fault["step"]))
        elif kind == EARLY:
            self._disturb(processes[fault["process"]], fault["duration"])
        elif kind == HAND:
            self._lift(fault["drone"], fault["duration"])
        elif kind == STATION_KILLED:
            processes["operator"].kill()
            self._end_when_down()
        elif kind == "told to end":
            processes[fault["process"]].retire()
        elif kind.startswith("station"):
            operator = processes["operator"]
            if kind == "station frozen":
                operator.freeze()
                self._later(fault["duration"], operator.thaw)
                return
            operator.kill()
            for process in [*self._drivers, *(processes[pilot] for pilot in self.world.plan.pilots.values())]:
                process.retire()
            self._end_when_down()
        elif kind == "kill" and any(driver.identity == fault["process"] for driver in self._drivers):
            self.result.world_ended = True
            self._later(WORLD_ENDED, self.world.scheduler.stop)

    def _land_again(self) -> None:
        """Have the second station land what it has sent up since the flight was over."""
        scheduler, console = self.world.scheduler, self.world.station(CONSOLE.kind)
        if console.core.asked or not self.recorder.all_down(self._bounds.down):
            self._order(CONSOLE.kind, "land")
            for _ in range(LANDING):
                scheduler.run(scheduler.now + SECOND)
                if not console.core.asked and self.recorder.all_down(self._bounds.down):
                    return

    def _disturb(self, process: VirtualProcess, lasts: float) -> None:
        """Kill a process, or freeze it for some s."""
        if not lasts:
            process.kill()
            return
        process.freeze()
        self._later(lasts, process.thaw)

    def _lift(self, drone: int, lasts: float) -> None:
        """Hold a Tello in a hand for some s, before the flight."""
        served = self.world.processes["kinematics"]._core._airframes[uav(drone)]
        if isinstance(served, ServedTello) and not self.recorder.began:
            airframe = served._tello.flight.airframe
            airframe.hold(1.0, served._now)
            self._later(lasts, lambda: airframe.hold(0.0, served._now))

    def _give(self, station: str, orders: list[tuple[Any, ...]]) -> None:
        """Have a station give these orders, one after another."""
        at = 0.0
        for after, *order in orders:
            at += after
            self._later(at, lambda order=order: self._order(station, *order))

    def _order(self, station: str, verb: str, formation: str = "", without: tuple[int, ...] = ()) -> None:
        """Have a station give an order; the operator gives it to the flight that it conducts."""
        self.recorder.tell(f"{station}: {verb} {formation} {without or ''}")
        virtual = self.world.station(station)
        if station == CONSOLE.kind:
            duration = 0.05 if formation == "hasty" else None
            virtual.ask(Order(verb, "wide" if duration else formation, duration, without))
        elif verb == "conduct":
            virtual.core.conduct(self.world.scheduler.now, DURATION)
        else:
            virtual.core.order(verb, self.world.scheduler.now)
        self.recorder.ordered(verb, self.world.scheduler.now)

    def _end_when_down(self, looks: int = 0) -> None:
        """End the flight that has no operator any more once all have been down for a second, or the world is gone."""
        down = self.recorder.all_down() or not any(one.alive for one in self._drivers)
        looks = looks + 1 if down else 0
        if looks > 10:
            self.world.scheduler.stop()
        else:
            self._later(0.1, lambda: self._end_when_down(looks))

    def _later(self, seconds: float, action: Callable[[], None]) -> None:
        scheduler = self.world.scheduler
        scheduler.at(scheduler.now + nanoseconds(seconds), lambda _: action())


def fly(seed: int, say: Callable[[str], None] | None = None, bounds: Bounds = BOUNDS) -> Result:
    """Fly the flight of `seed`; `say` takes what happens, line by line."""
    return Judge(drawn(seed), say, bounds).fly()


def fly_rare(seed: int, say: Callable[[str], None] | None = None) -> Result:
    """Fly the flight of `seed` with what `--rare` adds."""
    return Judge(drawn(seed, rare=True), say).fly()
