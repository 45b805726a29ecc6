"""Injects the faults of a drawn flight that no file of a search has: orders of both stations, hands, lost uplinks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from fault_draws import DURATION, Drawn
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.model import uav
from flockwire_core.wire.processes import CONSOLE, OPERATOR
from flockwire_lab.process import VirtualProcess
from flockwire_lab.search.events import EventInjector, SecondStation
from flockwire_lab.search.record import Recorder
from flockwire_lab.world import World
from flockwire_twins.tello.served import ServedTello
from rare_draws import CLOCK, EARLY, HAND, HASTY, LANDED, ORDERS, OTHER_FLIES, STATION_KILLED, UPLINK

BEFORE = (EARLY, HAND, OTHER_FLIES)  # counted from the flight's beginning, not from the order to take off
TOO_FAST = 0.05  # s for a change of formation, which cannot be flown
AFTER = 2 * SECOND  # ns flown on after an order to a flight that is over
LANDING, LANDINGS = 20, 3  # s in which a landing after the flight must end, and how often it is ordered
DOWN = 0.05  # m


class Injector(EventInjector):
    """The faults of `flight` in `world`; `recorder` is told of each."""

    def __init__(self, flight: Drawn, world: World, recorder: Recorder) -> None:
        faults, self._given, self._rare = flight.parsed()
        super().__init__(world, self._given, faults, recorder)
        self._flight = flight
        self._ordered: set[str] = set()  # verbs of orders that were published

    @property
    def _flies(self) -> bool:
        """Whether a drone is in the air, or a Tello has begun to take off without its driver."""
        airframes = self._world.processes["kinematics"]._core._airframes.values()
        return any(one.in_the_air or one.airframe.position[2] > DOWN for one in airframes)

    def start(self) -> None:
        """Start with what counts from the flight's beginning."""
        self._rare_later(lambda fault: fault["kind"] in BEFORE or fault.get("on") == "")

    def ordered(self, verb: str) -> None:
        """Record a published order; most faults count from the first one, which prepares or takes off."""
        if not self._ordered:
            self._rare_later(lambda fault: fault["kind"] not in (*BEFORE, ORDERS))
        if verb not in self._ordered:
            self._ordered.add(verb)
            self._rare_later(lambda fault: fault.get("on") == verb)

    def end(self) -> None:
        """Give the orders that come after the flight, and land whom nobody conducts."""
        if self._flight.after:
            self._give_order(OPERATOR.kind, self._flight.after)
            self._world.scheduler.run(self._world.scheduler.now + AFTER)
        orders = [fault for fault in self._rare if fault["kind"] == ORDERS]
        second = self._flight.after and any(isinstance(event, SecondStation) for event in self._given)
        if second or any(fault["station"] == CONSOLE.kind for fault in orders):
            self._land(CONSOLE.kind)
        elif any(verb in ("conduct", "start") for fault in orders for _, verb, *_ in fault["orders"]):
            self._land(OPERATOR.kind)  # the flight may have ended without those that fly by another order

    def _land(self, identity: str) -> None:
        """Have a station land all that are still up, again if need be."""
        scheduler, station = self._world.scheduler, self._world.station(identity)
        for second in range(LANDING * LANDINGS):
            if not station.core.is_ordering and not self._flies:
                return
            if second % LANDING == 0:
                station.ask(Order("land"))
            scheduler.run(scheduler.now + SECOND)

    def _rare_later(self, chosen: Callable[[dict[str, Any]], bool]) -> None:
        for fault in filter(chosen, self._rare):
            self._later(fault["at"], partial(self._inject_rare, fault))

    def _inject_rare(self, fault: dict[str, Any]) -> None:
        processes, kind = self._world.processes, fault["kind"]
        self._recorder.tell(f"fault: {fault}")
        if kind == ORDERS:
            at = 0.0
            for after, *order in fault["orders"]:
                at += after
                self._later(at, partial(self._give_order, fault["station"], *order))
        elif kind == CLOCK:
            processes[CONSOLE.kind].clock.step(nanoseconds(fault["step"]))
        elif kind == EARLY:
            self._disturb(processes[fault["process"]], fault["duration"])
        elif kind == HAND:
            self._lift(fault["drone"], fault["duration"])
        elif kind == UPLINK:
            self._mute(fault["drone"], fault["duration"])
        elif kind == OTHER_FLIES:
            self._world.conduct(None)
            self._later(LANDED, self._end_when_down)
        elif kind == STATION_KILLED:
            processes[OPERATOR.kind].kill()
            self._end_when_down()

    def _disturb(self, process: VirtualProcess, lasts: float) -> None:
        """Kill a process, or freeze it for some s."""
        if not lasts:
            process.kill()
            return
        process.freeze()
        self._later(lasts, process.thaw)

    def _lift(self, drone: int, lasts: float) -> None:
        """Hold a Tello in a hand for some s, before the flight."""
        served = self._world.processes["kinematics"]._core._airframes[uav(drone)]
        if isinstance(served, ServedTello) and not self._ordered:
            airframe = served._tello.flight.airframe
            airframe.hold(1.0, served._now)
            self._later(lasts, lambda: airframe.hold(0.0, served._now))

    def _mute(self, drone: int, lasts: float) -> None:
        """Lose for some s what a Tello is sent."""
        served = self._world.processes["kinematics"]._core._airframes[uav(drone)]
        if isinstance(served, ServedTello):
            bound = self._world._network._bound
            if (receive := bound.pop(served.address, None)) is None:
                return  # lost already
            self._later(lasts, lambda: bound.setdefault(served.address, receive))

    def _give_order(self, station: str, verb: str, formation: str = "", without: tuple[int, ...] = ()) -> None:
        """Have a station give an order; the operator gives it to the flight that it conducts."""
        self._recorder.tell(f"{station}: {verb} {formation} {without or ''}".rstrip())
        core, now = self._world.station(station).core, self._world.scheduler.now
        if station == CONSOLE.kind or verb in ("start", "formation"):
            hasty = formation == HASTY
            self._world.station(station).ask(
                Order(verb, "wide" if hasty else formation, TOO_FAST if hasty else None, without)
            )
        elif verb == "conduct":
            core.conduct(now, DURATION)
        else:
            core.order(verb, now)
        self._recorder.ordered("start" if verb == "conduct" else verb, now)
