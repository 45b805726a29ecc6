"""An operator's view of a fleet: the newest status of each pilot and the newest telemetry of each drone."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.pilot.orders import rank
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.processes import GATEWAY
from flockwire_core.wire.status import NO_MISSION, Report, Status

STALE = 2 * SECOND  # ns, maximum age of a status or telemetry
GATEWAY_SILENT = f"{GATEWAY.kind}: silent, it decides on orders that take up"
ON_GROUND = frozenset({Phase.GROUNDED, Phase.READY})
IN_THE_AIR = frozenset({FlightState.FLYING, FlightState.LANDING})
FLYING = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION})


class Fleet:
    """The state of a fleet at `now` (Unix ns), from `statuses` of processes and `telemetry` of drones.

    `pilots` are the identities of the pilots, by drone. The order in force is the one that the gateway reports. A
    pilot's report shows what one drone does, never what others are to do.
    """

    def __init__(
        self, pilots: Mapping[int, str], statuses: Mapping[str, Status], telemetry: Mapping[int, Telemetry], now: int
    ) -> None:
        self.pilots, self.now = pilots, now
        self._telemetry, self._statuses = telemetry, statuses
        self._recent = {one: status for one, status in statuses.items() if now - status.stamp < STALE}
        self.fresh = {drone: self._recent[pilot] for drone, pilot in pilots.items() if pilot in self._recent}
        heard = {drone: telemetry[drone] for drone in pilots if drone in telemetry}
        self.states = {drone: one.state for drone, one in heard.items() if now - one.stamp < STALE}
        self._gateway = self._report(GATEWAY.kind)  # None if it is silent
        # The time, s, since the gateway received its newest order, -1 before the first; None if it is silent.
        self.order_age = self._gateway.order_age if self._gateway is not None else None

    def _report(self, identity: str) -> Report | None:
        """Return the report of a process, None if it is silent."""
        return self._recent[identity].report if identity in self._recent else None

    def mission(self) -> Mission | None:
        """Return the order in force by the gateway's log, None if there is none or the gateway is silent."""
        return self._gateway.mission if self._gateway is not None else None

    def without(self, drones: Collection[int]) -> Fleet:
        """Return the fleet without `drones`."""
        if not drones:
            return self
        pilots = {drone: pilot for drone, pilot in self.pilots.items() if drone not in drones}
        return Fleet(pilots, self._statuses, self._telemetry, self.now)

    def present(self) -> Fleet:
        """Return the fleet without silent drones that are left out."""
        running = self.mission()
        return self.without([drone for drone in running.without if drone not in self.fresh] if running else ())

    @property
    def flies(self) -> bool:
        """Whether a drone is in the air."""
        return any(state in IN_THE_AIR for state in self.states.values())

    def has_stopped(self, drone: int) -> bool:
        """Return whether the drone's motors are known to be off."""
        return self.states.get(drone) is FlightState.STOPPED

    def received_stop(self, drone: int) -> bool:
        """Return whether the drone's driver has an emergency stop, obeyed already or not."""
        return self.has_stopped(drone) or (drone in self.states and self._telemetry[drone].stop_received)

    def phase(self, drone: int) -> str | None:
        """Return the phase of the drone's pilot, None if it is silent."""
        return self.fresh[drone].report.phase if drone in self.fresh else None

    def position(self, identity: str) -> Vector | None:
        """Return the position (m, world frame) that a process reports, None if it is silent or knows none."""
        report = self._report(identity)
        return report.position if report is not None else None

    def unclear(self) -> list[int]:
        """Return the drones whose pilots obey an order that is not in the gateway's log yet."""
        log = self.mission() or NO_MISSION
        return [
            drone
            for drone, status in self.fresh.items()
            if (status.report.mission or NO_MISSION).number > log.number
            or not set(status.report.unnumbered).issubset(log.downs)
        ]

    def all_in(self, *phases: Phase) -> bool:
        """Return whether every pilot is in one of `phases`."""
        return all(self.phase(drone) in phases for drone in self.pilots)

    def others_than(self, *phases: Phase) -> tuple[str, ...]:
        """Return a sentence for each pilot that is not in `phases`."""
        late = [drone for drone in self.pilots if self.phase(drone) not in phases]
        return tuple(f"{self.pilots[drone]}: {self.why(drone)}" for drone in late)

    def gateway_problem(self) -> tuple[str, ...]:
        """Return why a gateway accepts no order, or has no poses, for which pilots wait; empty without a problem."""
        return (GATEWAY_SILENT,) if self._gateway is None else self.waits(GATEWAY.kind)

    def waits(self, identity: str) -> tuple[str, ...]:
        """Return what a process waits for by its last status, which may be old: it may be frozen; empty for nothing."""
        last = self._statuses.get(identity)
        if last is None or last.report.phase != Phase.WAITING:
            return ()
        return (f"{identity}: {last.report.detail}",)

    def clocks_off(self, bound: float) -> dict[str, float]:
        """Return the clock bounds, s, by process, that are above `bound` or unknown (-1)."""
        return {s.identity: s.clock_bound for s in self._recent.values() if not 0.0 <= s.clock_bound <= bound}

    def flown(self) -> Mission | None:
        """Return the order by which drones are in a formation, None if none is."""
        log = self.mission()
        flies = log is not None and log.in_formation and any(self.phase(i) == Phase.FORMATION for i in self.pilots)
        return log if flies else None

    def unconfirmed(self, order: Mission) -> tuple[str, ...]:
        """Return the pilots that have not confirmed exactly this order."""
        return tuple(pilot for drone, pilot in self.pilots.items() if not self._obeys(drone, order))

    def lacking(self, order: Mission) -> tuple[str, ...]:
        """Return who is to get this order again: unconfirmed pilots, and a gateway that has not received it."""
        heard = self._gateway is None or _received(self._gateway, order)
        return (*self.unconfirmed(order), *(() if heard else (GATEWAY.kind,)))

    def unnumbered(self, pilots: Iterable[str]) -> tuple[str, ...]:
        """Return which of `pilots` obey a hold or a landing that has no number: they take up by no order."""
        return tuple(pilot for pilot in pilots if (report := self._report(pilot)) and report.unnumbered)

    def stronger(self, order: Mission) -> Mission | None:
        """Return the order in force if it outranks `order`, or was made from it; None if it does not."""
        log = self.mission()
        if log is None or log.version == order.version or log.number <= order.number:
            return None
        return log if rank(log) > rank(order) or (not rank(log) and order.version in log.downs) else None

    def restarted(self, order: Mission) -> bool:
        """Return whether every pilot obeys an upward order made from `order`, a landing: it came after all were down.

        Those that it leaves out must be known to be down.
        """
        log = self.mission()
        return (
            log is not None
            and not rank(log)
            and log.verb != "prepare"
            and order.version in log.downs
            and not self.unconfirmed(log)
            and all(self._is_down(drone, 0) for drone in log.without if drone in self.pilots)
        )

    def not_down(self, since: int = 0) -> tuple[str, ...]:
        """Return the drones that are in the air, or have not reported the ground after `since` (Unix ns)."""
        return tuple(uav(drone) for drone in self.pilots if not self._is_down(drone, since))

    def why(self, drone: int) -> str:
        """Return the report of the drone's pilot."""
        status = self._statuses.get(self.pilots[drone])
        if status is None:
            return "no status"
        return (status.report.line or status.report.phase) if drone in self.fresh else "silent"

    def reason_of_loss(self, drone: int) -> str:
        """Return why a drone no longer flies."""
        return "its motors stopped" if drone in self.fresh and self.has_stopped(drone) else self.why(drone)

    def _is_down(self, drone: int, since: int) -> bool:
        state = self.states.get(drone)
        return state is not None and state not in IN_THE_AIR and self._telemetry[drone].stamp > since

    def _obeys(self, drone: int, order: Mission) -> bool:
        report = self._report(self.pilots[drone])
        if report is None or report.mission is None or not _received(report, order):
            return False
        down = order.verb == "hold" and report.phase in ON_GROUND  # pilots that do not know it do not take off
        return down or report.mission.verb == order.verb


class Lost:
    """Finds the drones of a flight that no longer fly, unordered; each may seem lost for `grace` ns before it is."""

    def __init__(self, grace: int) -> None:
        self._grace = grace
        self._since: dict[int, int] = {}  # when each started to seem lost, Unix ns
        self._rose: set[int] = set()  # the drones that obeyed the take-off order

    def first(self, fleet: Fleet, taking_off: bool) -> int | None:
        """Return a lost drone, None if there is none; while `taking_off` it waits for drones still on the ground."""
        return next((drone for drone in fleet.pilots if self._is_lost(fleet, drone, taking_off)), None)

    def _is_lost(self, fleet: Fleet, drone: int, taking_off: bool) -> bool:
        """Return whether a drone no longer flies, by its status or telemetry."""
        silent, phase, state = drone not in fleet.fresh, fleet.phase(drone), fleet.states.get(drone)
        if phase in FLYING and state in IN_THE_AIR:
            self._rose.add(drone)
        if taking_off and not silent and drone not in self._rose:
            return False
        if phase in FLYING and state not in (FlightState.GROUNDED, FlightState.STOPPED):
            self._since.pop(drone, None)
            return False
        since = self._since.setdefault(drone, fleet.now)
        by_itself = phase == Phase.STOPPED or (phase == Phase.LANDING and drone not in fleet.unclear())
        return by_itself or fleet.now - since >= self._grace


def unrecorded(recorders: Iterable[str], statuses: Mapping[str, Status]) -> str:
    """Return which recorder could not record the whole flight by its last status, empty when all could."""
    reports = {identity: statuses[identity].report for identity in recorders if identity in statuses}
    return "; ".join(f"{identity}: {last.detail}" for identity, last in reports.items() if last.phase == Phase.FULL)


def _received(report: Report, order: Mission) -> bool:
    """Return whether a process has received `order`: it obeys it, or one that outranks it."""
    mission = report.mission
    if mission is not None and mission.has(order):
        return True
    return order.version in report.unnumbered
