"""Injects the faults of a drawn flight that the simulated world does not know: stations, their orders, hands, stops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from fault_draws import DURATION, SECOND_STATION, Drawn
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.order import Order
from flockwire_core.swarm.model import uav
from flockwire_core.wire.processes import CONSOLE, OPERATOR
from flockwire_lab.process import VirtualProcess
from flockwire_lab.world import World
from flockwire_twins.tello.served import ServedTello
from rare_draws import CLOCK, EARLY, HAND, HASTY, LANDED, ORDERS, OTHER_FLIES, STATION_KILLED, UPLINK

BEFORE = (EARLY, HAND, OTHER_FLIES)  # counted from the flight's beginning, not from the order to take off
TOO_FAST = 0.05  # s for a change of formation, which cannot be flown
WORLD_ENDED = 2.0  # s from the end of the kinematics to that of the flight
AFTER = 2 * SECOND  # ns flown on after an order to a flight that is over
LANDING, LANDINGS = 20, 3  # s in which a landing after the flight must end, and how often it is ordered
DOWN = 0.05  # m


class Injector:
    """The faults of `flight` in `world`; `places` are the drones' true positions, m; `tell` takes what happens."""

    def __init__(self, flight: Drawn, world: World, places: Mapping[str, Vector], tell: Callable[[str], None]) -> None:
        self.world_ended = False
        self._flight, self._world, self._places, self._tell = flight, world, places, tell
        self._drivers = [world.processes[name] for name, row in world.plan.rows.items() if row.driver]
        self._ordered: set[str] = set()  # verbs of orders that were published
        self._landing: int | None = None  # when a landing was ordered, and no flight after it

    @property
    def landing(self) -> float:
        """The time, s, since a landing was ordered beside the flight's own, and no new flight; 0 without one."""
        return 0.0 if self._landing is None else (self._world.scheduler.now - self._landing) / SECOND

    @property
    def _flies(self) -> bool:
        """Whether a drone is in the air, or a Tello has begun to take off without its driver."""
        airframes = self._world.processes["kinematics"]._core._airframes.values()
        return any(one.in_the_air or one.position[2] > DOWN for one in airframes)

    def begin(self) -> None:
        """Start with what counts from the flight's beginning."""
        self._inject_later(lambda fault: fault["kind"] in BEFORE or fault.get("on") == "")

    def ordered(self, verb: str) -> None:
        """Record a published order; most faults count from the first one, which prepares or takes off."""
        if not self._ordered:
            self._inject_later(lambda fault: fault["kind"] not in (*BEFORE, ORDERS))
        if verb not in self._ordered:
            self._ordered.add(verb)
            self._inject_later(lambda fault: fault.get("on") == verb)

    def end(self) -> None:
        """Give the orders that come after the flight, and land whom nobody conducts."""
        if self._flight.after:
            self._order(OPERATOR.kind, self._flight.after)
            self._world.scheduler.run(self._world.scheduler.now + AFTER)
        orders = [fault for fault in self._flight.faults if fault["kind"] == ORDERS]
        second = self._flight.after and any(fault["kind"] == SECOND_STATION for fault in self._flight.faults)
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

    def _inject_later(self, chosen: Callable[[dict[str, Any]], bool]) -> None:
        for fault in filter(chosen, self._flight.faults):
            self._later(fault["at"], lambda fault=fault: self._inject(fault))

    def _later(self, seconds: float, action: Callable[[], None]) -> None:
        scheduler = self._world.scheduler
        scheduler.at(scheduler.now + nanoseconds(seconds), lambda _: action())

    def _inject(self, fault: dict[str, Any]) -> None:
        processes, kind = self._world.processes, fault["kind"]
        self._tell(f"fault: {fault}")
        if kind == "stop":
            self._world.stop("bench")
        elif kind in (ORDERS, SECOND_STATION):
            self._give(fault.get("station", CONSOLE.kind), fault["orders"])
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
        elif kind == "told to end":
            processes[fault["process"]].retire()
        elif kind == "station frozen":
            self._disturb(processes[OPERATOR.kind], fault["duration"])
        elif kind in ("station lost", STATION_KILLED):
            self._lose_station(told=kind == "station lost")
        elif kind == "kill" and any(driver.identity == fault["process"] for driver in self._drivers):
            self.world_ended = True
            self._later(WORLD_ENDED, self._world.scheduler.stop)

    def _lose_station(self, told: bool) -> None:
        """Kill the operator; its pilots and drivers are `told` to end, or not."""
        processes = self._world.processes
        processes[OPERATOR.kind].kill()
        if told:
            for process in [*self._drivers, *(processes[pilot] for pilot in self._world.plan.pilots.values())]:
                process.retire()
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

    def _give(self, station: str, orders: list[tuple[Any, ...]]) -> None:
        """Have a station give these orders, one after another."""
        at = 0.0
        for after, *order in orders:
            at += after
            self._later(at, lambda order=order: self._order(station, *order))

    def _order(self, station: str, verb: str, formation: str = "", without: tuple[int, ...] = ()) -> None:
        """Have a station give an order; the operator gives it to the flight that it conducts."""
        self._tell(f"{station}: {verb} {formation} {without or ''}".rstrip())
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
        if verb in ("land", "start", "conduct"):
            self._landing = now if verb == "land" else None

    def _end_when_down(self, looks: int = 0) -> None:
        """End the flight that has no operator any more once all have been down for a second, or the world is gone."""
        down = all(place[2] <= 0.0 for place in self._places.values()) or not any(one.alive for one in self._drivers)
        looks = looks + 1 if down else 0
        if looks > 10:
            self._world.scheduler.stop()
        else:
            self._later(0.1, lambda: self._end_when_down(looks))
