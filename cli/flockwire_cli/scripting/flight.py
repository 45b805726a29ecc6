"""What a script sees of a flight: orders that return when they are obeyed, and how every drone is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flockwire.control.graph import LEADER
from flockwire.control.vector import Vector
from flockwire.flight.director import LEAD_TIME, Stage
from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.messages import Mission
from flockwire.wire.plan import Plan

from flockwire_cli.scripting.script_director import ScriptDirector

if TYPE_CHECKING:
    from flockwire.wire.status import Report
    from flockwire_recorder.summary import Summary

PATIENCE = 60.0  # s that an order may take
LOOK = 0.05  # s between two looks


class FlightError(RuntimeError):
    """An order that was not obeyed; the text says why."""


@dataclass(frozen=True, slots=True)
class DroneStatus:
    """How a drone is; -1 and None stand for what is not known."""

    phase: str  # "grounded", "ready", "take-off", "hold", "formation", "landing", "stopped"; "" while it is silent
    detail: str = ""  # what it waits for, or why it is in this phase
    position: Vector | None = None  # m, world frame
    battery: float = -1.0  # share of full
    formation_error: float = -1.0  # m, by its own estimate


class Flight(ABC):
    """A flight by script; `summary` is there when it has ended. All times are s, all lengths m."""

    def __init__(self, plan: Plan, director: ScriptDirector) -> None:
        self._plan, self._director = plan, director
        self.summary: Summary | None = None

    @property
    def swarm(self) -> Swarm:
        """The swarm file's content."""
        return self._plan.swarm

    @property
    def drones(self) -> dict[int, DroneStatus]:
        """How every drone is, by its id (0: the leader)."""
        fresh = self._director.fleet.fresh
        return {i: _status(fresh[i].report if i in fresh else None) for i in self._plan.pilots}

    async def start(self, formation: str = "") -> None:
        """Take off where need be and fly `formation`, a name of [formations]; returns when all do."""
        self._known(formation)
        if self._director.stage is Stage.FLYING:
            self._director.resume(self._now())
        else:
            self._director.begin(formation, self._now())
        await self._until(self._director.flying, "start")

    async def hold(self) -> None:
        """Leave the formation and hover; returns when all do."""
        self._director.hold(self._now())
        await self.wait_for(Phase.HOLD)

    async def formation(self, name: str, duration: float | None = None) -> None:
        """Change to the formation `name` in `duration` s, None: as few as keep to all limits; returns after it."""
        from flockwire.flight.formation_planning import ChangeRefusedError, plan_in_time  # noqa: PLC0415  (numpy)

        self._known(name)
        fleet, now = self._director.fleet, self._now()
        running = fleet.mission()
        if self._director.stage is not Stage.FLYING or running is None:
            raise FlightError(f"formation {name!r}: nobody flies a formation")
        try:
            position = self.drones[LEADER].position if LEADER in self.drones else None
            order = plan_in_time(self.swarm, running, name, self._now, position, duration)
        except ChangeRefusedError as error:
            raise FlightError(f"formation {name!r}: {error}") from None
        self._director.change(order)
        await self._until(lambda: self._director.confirmed() and self._now() >= _end(order, now), f"formation {name!r}")

    async def land(self) -> None:
        """Land all drones where they are; returns when they are down."""
        self._director.land(self._now())
        await self._until(lambda: self._director.stage is Stage.OVER, "land")

    async def stop(self, reason: str = "the script's order") -> None:
        """Emergency: motors off, at once; returns when all have stopped."""
        self._stop(reason)
        stopped = Phase.STOPPED
        await self._until(lambda: all(drone.phase == stopped for drone in self.drones.values()), "stop", failing=True)

    async def wait_for(self, phase: str, drones: Iterable[int] | None = None, patience: float = PATIENCE) -> None:
        """Wait until `drones` (all, without them) are in `phase`; raises FlightError after `patience` s."""
        wanted = tuple(self._plan.pilots if drones is None else drones)
        await self._until(lambda: all(self.drones[i].phase == phase for i in wanted), f"wait for {phase!r}", patience)

    @abstractmethod
    async def sleep(self, seconds: float) -> None:
        """Let `seconds` of the flight pass."""

    @abstractmethod
    def _now(self) -> int:
        """Return the present time, Unix ns."""

    @abstractmethod
    def _stop(self, reason: str) -> None:
        """Give the order to stop all motors."""

    def _known(self, formation: str) -> None:
        if formation and formation not in self.swarm.formations:
            raise FlightError(f"formation {formation!r}: must be one of {sorted(self.swarm.formations)} ([formations])")

    async def _until(
        self, done: Callable[[], bool], what: str, patience: float = PATIENCE, failing: bool = False
    ) -> None:
        """Wait until `done`; raises FlightError after `patience` s, and when the flight fails (unless `failing`)."""
        deadline = self._now() + round(patience * BILLION)
        before = self._director.failure
        while not done():
            if self._director.failure != before and not failing:
                raise FlightError(f"{what}: {self._director.failure}")
            if self._now() >= deadline:
                phases = ", ".join(f"{self._plan.pilots[i]} {drone.phase}" for i, drone in self.drones.items())
                raise FlightError(f"{what}: not done after {patience:g} s: {phases}")
            await self.sleep(LOOK)


def _end(order: Mission, now: int) -> int:
    """Return when a change of formation is over, Unix ns."""
    if order.change is None:
        return now + LEAD_TIME
    return order.change.begin + round(order.change.duration * BILLION)


def _status(report: Report | None) -> DroneStatus:
    if report is None:
        return DroneStatus("")
    return DroneStatus(report.phase, report.detail, report.position, report.battery, report.formation_error)
