"""A script's interface to a flight: orders that return when they are obeyed, and the state of every drone."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flockwire_core.domain.order import Answer, Order
from flockwire_core.domain.time import nanoseconds
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.director import LEAD_TIME, Stage
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.operator import OperatorCore
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan

if TYPE_CHECKING:
    from flockwire_analysis.key_figures import Summary
    from flockwire_core.wire.status import Report

ORDER_TIME = 60.0  # s for an order, beside the climb or descent that it takes


class FlightError(RuntimeError):
    """An order that was not obeyed; the text gives the reason."""


@dataclass(frozen=True, slots=True)
class DroneStatus:
    """The state of a drone; -1 and None mean unknown."""

    phase: str  # a Phase (wire/phase.py) like "hold"; "" while it is silent
    detail: str = ""  # the awaited input, or the reason of the phase
    position: Vector | None = None  # m, world frame
    battery: float = -1.0  # share of full
    formation_error: float | None = None  # m, by its own estimate; None for the leader, and outside a formation


class Flight:
    """A flight by script; `summary` is available after its end. All times are s, all lengths m."""

    def __init__(
        self,
        plan: Plan,
        core: OperatorCore,
        now: Callable[[], int],
        sleep: Callable[[float], Awaitable[None]],
        publish: Callable[[], None] = lambda: None,
    ) -> None:
        """Fly by the orders of `core`, at `now` (Unix ns); `publish` sends them before its next step."""
        self._plan, self._core, self._now, self._sleep, self._publish = plan, core, now, sleep, publish
        self.summary: Summary | None = None

    @property
    def swarm(self) -> Swarm:
        """The swarm file's content."""
        return self._plan.swarm

    @property
    def drones(self) -> dict[int, DroneStatus]:
        """The state of every drone that flies, by its id."""
        fresh = self._fleet().fresh
        return {i: _status(fresh[i].report) if i in fresh else DroneStatus("") for i in self._plan.pilots}

    async def start(self, formation: str = "") -> None:
        """Take off if necessary and fly `formation`, a name of [formations]; returns when all drones do."""
        self._known(formation)
        director = self._core.director
        if director is not None and director.stage is Stage.FLYING:
            running = self._fleet().mission()
            if running is not None and running.start and running.formation != formation:
                await self.formation(formation)
            else:
                self._order("resume")
        else:
            director = self._core.conduct(self._now(), order=Order("start", formation))
        await self._until(lambda: director.stage is Stage.FLYING and self._fleet().all_in(Phase.FORMATION), "start")

    async def hold(self) -> None:
        """Leave the formation and hover; returns when all drones do."""
        if self._core.director is not None:
            self._order("hold")
        await self.wait_for(Phase.HOLD)

    async def formation(self, name: str, duration: float | None = None) -> None:
        """Change to the formation `name` in `duration` s (None: the fewest within all limits); returns after it."""
        self._known(name)
        if self._core.director is None or self._core.director.stage is not Stage.FLYING:
            raise FlightError(f"formation {name!r}: no drone flies a formation")
        now = self._now()
        answers: list[Answer] = []
        self._core.ask(Order("formation", name, duration), now, answered=answers.append)
        await self._until(lambda: bool(answers), f"formation {name!r}")
        if failure := answers[0].failure:
            raise FlightError(f"formation {name!r}: {failure}")
        await self._until(lambda: self._now() >= self._end(now), f"formation {name!r}")

    async def land(self) -> None:
        """Land all drones where they are; returns when they are down."""
        director = self._core.director
        if director is None:
            return
        self._order("land")
        await self._until(lambda: director.stage is Stage.OVER, "land")

    async def stop(self, reason: str = "the script's order") -> None:
        """Emergency: motors off, at once; returns when all have stopped."""
        self._core.ask(Order("stop", reason=reason), self._now())
        self._publish()
        stopped = Phase.STOPPED
        await self._until(lambda: all(drone.phase == stopped for drone in self.drones.values()), "stop", failing=True)

    async def wait_for(self, phase: str, drones: Iterable[int] | None = None, patience: float = ORDER_TIME) -> None:
        """Wait until `drones` (all, without them) are in `phase`; raises FlightError after `patience` s.

        It does so at once where there is no such phase.
        """
        if phase not in tuple(Phase):
            raise FlightError(f"wait for {phase!r}: must be one of {', '.join(Phase)}")
        wanted = tuple(self._plan.pilots if drones is None else drones)
        await self._until(lambda: all(self.drones[i].phase == phase for i in wanted), f"wait for {phase!r}", patience)

    async def sleep(self, seconds: float) -> None:
        """Let `seconds` of the flight pass."""
        await self._sleep(seconds)

    async def _land_what_flies(self) -> None:
        """Land at the end of the script, if a flight is in progress."""
        if self._is_under_way:
            self._order("land")
            await self._until(lambda: not self._is_under_way, "land", failing=True)

    def _order(self, verb: str) -> None:
        self._core.order(verb, self._now())
        self._publish()

    def _fleet(self) -> Fleet:
        return self._core.fleet(self._now())

    def _end(self, asked: int) -> int:
        """Return when the change of formation that was `asked` for (Unix ns) has ended."""
        running = self._fleet().mission()
        if running is None or running.change is None:
            return asked + LEAD_TIME
        return running.change.begin + nanoseconds(running.change.duration)

    @property
    def _failure(self) -> str:
        """Why the newest flight failed; empty if it did not."""
        return self._core.director.failure if self._core.director is not None else ""

    @property
    def _is_under_way(self) -> bool:
        """Whether the newest flight is in progress."""
        return self._core.director is not None and self._core.director.stage is not Stage.OVER

    def _known(self, formation: str) -> None:
        if formation and formation not in self.swarm.formations:
            raise FlightError(f"formation {formation!r}: must be one of {sorted(self.swarm.formations)} ([formations])")

    async def _until(
        self, done: Callable[[], bool], what: str, patience: float | None = None, failing: bool = False
    ) -> None:
        """Wait until `done`; raises FlightError after `patience` s, and when the flight fails (unless `failing`)."""
        look = 0.05  # s between two checks
        if patience is None:
            patience = ORDER_TIME + self.swarm.climb_time
        deadline = self._now() + nanoseconds(patience)
        before = self._failure
        while not done():
            if self._failure != before and not failing:
                raise FlightError(f"{what}: {self._failure}")
            if self._now() >= deadline:
                phases = ", ".join(f"{self._plan.pilots[i]} {drone.phase}" for i, drone in self.drones.items())
                raise FlightError(f"{what}: not done after {patience:g} s: {phases}")
            await self.sleep(look)


def _status(report: Report) -> DroneStatus:
    error = report.formation_error if report.formation_error >= 0.0 else None
    return DroneStatus(report.phase, report.line, report.position, report.battery, error)
