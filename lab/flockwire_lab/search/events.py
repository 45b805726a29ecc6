"""What happens to the operators of a virtual flight, beside the faults of faults/kinds.py; one file has both."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Literal

from flockwire_core.domain.order import Order
from flockwire_core.domain.time import nanoseconds
from flockwire_core.swarm.tables import Items, Model, NotNegative, Positive
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import CONSOLE, DRIVER, KINEMATICS, OPERATOR
from pydantic import Field

from flockwire_lab.faults.injection import possible_faults
from flockwire_lab.faults.kinds import ClockStep, Fault, FaultKind, Freeze
from flockwire_lab.search.record import Recorder
from flockwire_lab.world import World

STOP, TOLD_TO_END, STATION_FROZEN, STATION_LOST = "stop", "told to end", "station frozen", "station lost"
SECOND_STATION = "second station"  # gives orders of its own beside the one that conducts
LaterOrder = Annotated[tuple[NotNegative, Literal["hold", "land", "start"]], Field(strict=False)]


class StopOrder(FaultKind):
    """The operator orders an emergency stop."""

    kind: Literal["stop"]


class Retirement(FaultKind):
    """A process gets SIGTERM."""

    kind: Literal["told to end"]
    process: str


class StationFreeze(FaultKind):
    """The operator that conducts the flight is frozen."""

    kind: Literal["station frozen"]
    duration: Positive


class StationLoss(FaultKind):
    """The operator ends at once, and with it the parent of all processes: they get SIGTERM."""

    kind: Literal["station lost"]


class SecondStation(FaultKind):
    """Another station gives `orders`, each some s after the one before."""

    kind: Literal["second station"]
    orders: Annotated[Items[LaterOrder], Field(min_length=1)]


Event = StopOrder | Retirement | StationFreeze | StationLoss | SecondStation


class _File(Model):
    faults: Items[Annotated[Fault | Event, Field(discriminator="kind")]] = ()


def parse_events(tables: list[dict[str, Any]], plan: Plan, origin: str) -> tuple[tuple[Fault, ...], tuple[Event, ...]]:
    """Return the faults for the world, and the events; raises InputError for bad ones."""
    listed = possible_faults({"faults": tables}, plan, origin, _File)
    events = tuple(one for one in listed if isinstance(one, Event))
    faults = tuple(one for one in listed if not isinstance(one, Event))
    return faults, events


class EventInjector:
    """Injects `events` into `world`, and ends a flight that has no operator or no bodies any more.

    `recorder` is told of each, tells when the flight begins, and whether all drones are down.
    """

    def __init__(self, world: World, events: tuple[Event, ...], faults: tuple[Fault, ...], recorder: Recorder) -> None:
        self.world_ended = False
        self._world, self._events, self._faults, self._recorder = world, events, faults, recorder
        self._drivers = [name for name, row in world.plan.rows.items() if row.driver]
        self.moving = {KINEMATICS.kind, *self._drivers}  # the airframes
        recorder.begin = self.begin

    def begin(self) -> None:
        """Set time 0, the order to take off, to the current time."""
        for event in self._events:
            self._later(event.at, partial(self._inject, event))
        for fault in self._faults:
            self._later(fault.at, partial(self._recorder.tell, f"fault: {fault!r}"))
            if fault.kind == "kill" and fault.process in self._drivers:
                self._later(fault.at, self._end_world)

    @property
    def still(self) -> tuple[tuple[float, float], ...]:
        """From when to when the simulated airframes stand still, s: by a freeze, or as their clock was set back."""
        found: list[tuple[float, float]] = []
        for fault in self._faults:
            if isinstance(fault, Freeze) and fault.process in self.moving:
                found.append((fault.at, fault.at + fault.duration))
            elif isinstance(fault, ClockStep) and fault.process == KINEMATICS.kind and fault.step < 0.0:
                found.append((fault.at, fault.at - fault.step))
        return tuple(found)

    @property
    def jumps(self) -> tuple[float, ...]:
        """When the simulated airframes' clock is set ahead, s: they fly some time in one step."""
        steps = (fault for fault in self._faults if isinstance(fault, ClockStep))
        return tuple(fault.at for fault in steps if fault.process == KINEMATICS.kind and fault.step > 0.0)

    def frozen(self, begin: float, end: float) -> bool:
        """Return whether the airframes stood still between two times, s, or drivers did not see them move yet.

        A driver may see only by the motors' time, in whole seconds, whether they run.
        """
        motors_seen = 2.0  # s after a freeze of an airframe
        unseen = motors_seen if self._world.plan.of(DRIVER) else 0.0
        return any(first <= end and begin < last + unseen for first, last in self.still)

    def retire(self) -> None:
        """Tell pilots and drivers to end, as their parent does that ends; the flight ends once all are down."""
        for name in (*self._drivers, *self._world.plan.pilots.values()):
            self._world.processes[name].retire()
        self._end_when_down()

    def _end_world(self) -> None:
        world_ended = 2.0  # s from the end of the kinematics to that of the flight
        self.world_ended = True
        self._later(world_ended, self._world.scheduler.stop)

    def _inject(self, event: Event) -> None:
        self._recorder.tell(f"event: {event!r}")
        processes = self._world.processes
        match event:
            case StopOrder():
                self._world.stop("a stop of the file")
            case Retirement():
                processes[event.process].retire()
            case StationFreeze():
                processes[OPERATOR.kind].freeze()
                self._later(event.duration, processes[OPERATOR.kind].thaw)
            case StationLoss():
                processes[OPERATOR.kind].kill()
                self.retire()
            case SecondStation():
                at = 0.0
                for after, verb in event.orders:
                    at += after
                    self._later(at, partial(self._order, verb))

    def _order(self, verb: str) -> None:
        self._recorder.tell(f"second station: {verb}")
        self._recorder.ordered(verb, self._world.scheduler.now)
        self._world.station(CONSOLE.kind).ask(Order(verb))

    def _end_when_down(self, looks: int = 0) -> None:
        """End the flight that has no operator any more once all have been down for a second, or the world is gone."""
        down_for = 10  # looks, 0.1 s apart, at which all are down before a flight without an operator ends
        processes = self._world.processes
        self.world_ended |= not processes[KINEMATICS.kind].alive  # a restarted one has nobody in the air
        down = self._recorder.all_down() or self.world_ended or not any(processes[one].alive for one in self._drivers)
        looks = looks + 1 if down else 0
        if looks > down_for:
            self._world.scheduler.stop()
        else:
            self._later(0.1, lambda: self._end_when_down(looks))

    def _later(self, seconds: float, action: Callable[[], None]) -> None:
        scheduler = self._world.scheduler
        scheduler.at(scheduler.now + nanoseconds(seconds), lambda _: action())
