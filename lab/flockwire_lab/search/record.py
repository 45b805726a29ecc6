"""A tap that records one virtual flight: its arrays, its reactions, what happens in words."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from flockwire_analysis.conformance import deviations
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.pilot.reactions import TABLE
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

from flockwire_lab.flight import TraceInMemory
from flockwire_lab.process import Published
from flockwire_lab.search.margin import Flown, Reports, States
from flockwire_lab.world import EPOCH

DRIVER_STOPS, DRIVER_LANDS = "driver: zero", "driver: land"  # reactions to old commands
REACTIONS = (*(row.code for row in TABLE), DRIVER_STOPS, DRIVER_LANDS)
OF_THE_PROTOCOL = ("status", "telemetry", "mission", "stop")  # kinds that show what pilots did by which orders
TIMED = ("truth", "pose", "command")  # the other kinds that it keeps


class Recorder:
    """Collects a flight of the swarm of `plan`; `begin` is called at the first order, `say` takes what happens."""

    def __init__(self, plan: Plan, say: Callable[[str], None] | None = None) -> None:
        self.begin: Callable[[], object] = lambda: None
        self.reactions: dict[str, float] = {}  # of pilots and drivers, by code: when each came first, s
        self._swarm, self._say = plan.swarm, say
        self._pilots = {identity: uav(drone) for drone, identity in plan.pilots.items()}
        self._taken = TraceInMemory(plan.swarm, 0)
        self.took_off: int | None = None  # when the first order was given, Unix ns
        self._at = EPOCH
        self._truth: dict[str, list[tuple[int, Vector]]] = defaultdict(list)
        self._stamps: dict[Key, list[int]] = defaultdict(list)  # of poses and commands
        self._reports: dict[str, list[tuple[int, Status]]] = defaultdict(list)
        self._telemetries: dict[str, list[tuple[int, Telemetry]]] = defaultdict(list)
        self._phases: dict[str, tuple[str, str]] = {}
        self.starts: list[tuple[int, Mission]] = []  # orders into a formation, and when they were published
        self.landing: int | None = None  # when the operator first ordered to land
        self.stopped: int | None = None  # when an emergency stop was ordered first
        self._landing: int | None = None  # when another station ordered it, after which it ordered no start
        self._refused: list[tuple[float, str]] = []

    def take(self, published: Published) -> None:
        """Receive what is published."""
        key, at = published.key, published.at
        if key.kind in OF_THE_PROTOCOL:
            self._taken.take(published)
        elif key.kind not in TIMED:
            return
        self._at = at
        match published.message:
            case Pose(position=place) if key.kind == "truth":
                self._truth[key.owner].append((at, place))
            case Pose() | Command():
                self._stamps[key].append(at)
            case Status() as status:
                self._status(status)
            case Telemetry() as telemetry:
                self._telemetry(key.owner, telemetry)
            case Mission() as mission:
                self._mission(mission)
            case Stop():
                self.stopped = self.stopped or at

    @cached_property
    def protocol(self) -> Trace:
        """What pilots did by which orders, once the flight is over."""
        return self._taken.trace()

    def ordered(self, verb: str, at: int) -> None:
        """Note that the second station ordered `verb` at `at` (Unix ns)."""
        if verb in ("land", "start"):
            self._landing = at if verb == "land" else None

    def tell(self, what: str) -> None:
        """Pass on what happens."""
        if self._say is not None:
            self._say(f"{self.seconds(self._at):8.3f} s  {what}")

    def all_down(self) -> bool:
        """Return whether all drones are on the ground now."""
        return all(places[-1][1][2] <= 0.0 for places in self._truth.values())

    def places(self, at: int) -> dict[str, Vector]:
        """Return the newest true positions at `at` (Unix ns), m."""
        return {
            owner: rows[max(bisect_right(rows, at, key=lambda row: row[0]) - 1, 0)][1]
            for owner, rows in self._truth.items()
        }

    def held(self, owner: str, at: int) -> int | None:
        """Return the place that a drone held by an auction at `at` (Unix ns), by its newest status, None: none."""
        rows = self._reports[owner]
        place = bisect_right(rows, at, key=lambda row: row[0])
        return rows[place - 1][1].report.place if place else None

    def phases(self) -> dict[str, str]:
        """Return the phase that each pilot reported last, by its drone."""
        return {owner: phase for owner, (phase, _) in self._phases.items()}

    def flown(self, end: int, failure: str = "", **about: Any) -> Flown:  # noqa: ANN401  (fields of one)
        """Return the flight that ended at `end` (Unix ns); `about` are the fields of `Flown` that no message tells."""
        return Flown(
            self._swarm,
            {owner: self._times([at for at, _ in rows]) for owner, rows in self._truth.items()},
            {owner: np.array([place for _, place in rows]) for owner, rows in self._truth.items()},
            {key.owner: self._times(stamps) for key, stamps in self._stamps.items() if key.kind == "pose"},
            {key.owner: self._times(stamps) for key, stamps in self._stamps.items() if key.kind == "command"},
            {owner: self._reported(rows) for owner, rows in self._reports.items()},
            {owner: self._stated(rows) for owner, rows in self._telemetries.items()},
            self.took_off is not None,
            np.inf if self.stopped is None else self.seconds(self.stopped),
            tuple(self._refused),
            deviations(self.protocol),
            failure,
            (end - EPOCH) / SECOND,
            **about,
        )

    def _reported(self, rows: list[tuple[int, Status]]) -> Reports:
        reports = [status.report for _, status in rows]
        shown = [(one.pose_age, one.nearby_age, one.telemetry_age, one.battery) for one in reports]
        pose, nearby, telemetry, battery = np.array(shown).reshape(-1, 4).T
        steps = [0, *(status.steps for _, status in rows)]
        begun = [at for k, (at, status) in enumerate(rows) if not k or status.steps < steps[k]]
        return Reports(
            self._times([at for at, _ in rows]), tuple(one.phase for one in reports), pose, nearby, telemetry, battery,
            self._times(begun),
        )  # fmt: skip

    def _stated(self, rows: list[tuple[int, Telemetry]]) -> States:
        return States(
            self._times([at for at, _ in rows]),
            tuple(one.state for _, one in rows),
            np.array([one.stop_received for _, one in rows], np.bool_),
            np.array([one.command_age for _, one in rows]),
        )

    def seconds(self, at: int) -> float:
        """Return `at` (Unix ns) as s after the order to take off; before it, after the beginning."""
        return (at - (self.took_off or EPOCH)) / SECOND

    def _times(self, stamps: list[int]) -> Floats:
        return (np.array(stamps, np.int64) - (self.took_off or EPOCH)) / SECOND

    def _mission(self, mission: Mission) -> None:
        if self.took_off is None:
            self.took_off = self._at
            self.begin()
        self.tell(f"order: {mission.verb}")
        if mission.in_formation:
            self.starts.append((self._at, mission))
        elif mission.verb == "land":
            self.landing = self.landing or self._at

    def _status(self, status: Status) -> None:
        owner = self._pilots.get(status.identity)
        if owner is None:
            return
        report = status.report
        self._reports[owner].append((self._at, status))
        if self._phases.get(owner) != (report.phase, report.detail):
            self._phases[owner] = (report.phase, report.detail)
            self.tell(f"{status.identity}: {report.phase} {report.detail}")
            if report.phase == Phase.TAKEOFF and self._landing is not None and self._at > self._landing:
                self._refused.append(((self._at - self._landing) / SECOND, owner))
        if report.code:
            self._reached(report.code)

    def _telemetry(self, owner: str, message: Telemetry) -> None:
        stale = self._swarm.limits.staleness
        self._telemetries[owner].append((self._at, message))
        if message.state is FlightState.FLYING and message.command_age > stale.command_zero:
            self._reached(DRIVER_STOPS)
        elif message.state is FlightState.LANDING and message.command_age > stale.command_land:
            self._reached(DRIVER_LANDS)

    def _reached(self, code: str) -> None:
        if self.took_off is not None:
            self.reactions.setdefault(code, round(self.seconds(self._at), 3))
