"""An operator's view of a fleet: the newest status of each pilot and the newest telemetry of each drone."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.known_orders import KnownOrders
from flockwire_core.pilot.orders import came_down, rank
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.processes import GATEWAY
from flockwire_core.wire.status import Report, Status

STALE = 2 * SECOND  # ns, maximum age of a status or telemetry
ON_GROUND = frozenset({Phase.GROUNDED, Phase.READY})
IN_THE_AIR = frozenset({FlightState.FLYING, FlightState.LANDING})


class Fleet:
    """The state of a fleet at `now` (Unix ns), from `statuses` of processes and `telemetry` of drones.

    `pilots` are the identities of the pilots, by drone. Of the orders in their reports only the `known` ones count.
    """

    def __init__(
        self,
        pilots: Mapping[int, str],
        statuses: Mapping[str, Status],
        telemetry: Mapping[int, Telemetry],
        now: int,
        known: KnownOrders,
    ) -> None:
        self.pilots, self.now, self.known = pilots, now, known
        self._telemetry = telemetry
        fresh = {name: one.report for name, one in statuses.items() if now - one.stamp < STALE}
        known.compare([fresh.get(pilot) for pilot in pilots.values()])
        self._statuses = statuses = {name: known.checked(status) for name, status in statuses.items()}
        self.fresh = {
            drone: statuses[pilot]
            for drone, pilot in pilots.items()
            if pilot in statuses and now - statuses[pilot].stamp < STALE
        }
        self.states = {
            drone: telemetry[drone].state
            for drone in pilots
            if drone in telemetry and now - telemetry[drone].stamp < STALE
        }

    @property
    def _gateway(self) -> tuple[Status, ...]:
        """The gateway's status, none if there is no fresh one."""
        status = self._statuses.get(GATEWAY.kind)
        return (status,) if status is not None and self.now - status.stamp < STALE else ()

    def without(self, drones: Collection[int]) -> Fleet:
        """Return the fleet without `drones`."""
        if not drones:
            return self
        pilots = {drone: pilot for drone, pilot in self.pilots.items() if drone not in drones}
        return Fleet(pilots, self._statuses, self._telemetry, self.now, self.known)

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
        status = self._statuses.get(identity)
        return status.report.position if status is not None and self.now - status.stamp < STALE else None

    def names_unknown(self, drone: int) -> bool:
        """Return whether the drone's pilot names an order that is not known: only its version counts."""
        report = self.fresh[drone].report if drone in self.fresh else None
        return report is not None and report.mission is None and bool(report.concurrent)

    def all_in(self, *phases: Phase) -> bool:
        """Return whether every pilot is in one of `phases`."""
        return all(self.phase(drone) in phases for drone in self.pilots)

    def others_than(self, *phases: Phase) -> tuple[str, ...]:
        """Return a sentence for each pilot that is not in `phases`."""
        late = [drone for drone in self.pilots if self.phase(drone) not in phases]
        return tuple(f"{self.pilots[drone]}: {self.why(drone)}" for drone in late)

    def without_poses(self) -> tuple[str, ...]:
        """Return the reason of a gateway that has no poses: then pilots only wait for theirs."""
        return tuple(f"{s.identity}: {s.report.detail}" for s in self._gateway if s.report.phase == Phase.WAITING)

    def clocks_off(self, bound: float) -> dict[str, float]:
        """Return the clock bounds, s, by process, that are above `bound` or unknown (-1)."""
        fresh = [status for status in self._statuses.values() if self.now - status.stamp < STALE]
        return {s.identity: s.clock_bound for s in fresh if not 0.0 <= s.clock_bound <= bound}

    def mission(self) -> Mission | None:
        """Return the order in force: an order that pilots obey and that no later upward order names.

        A landing is preferred, then a hold, then a hold of a pilot that knows the interrupted formation. The upward
        order of a drone that has landed since, or was left out, counts only without another.
        """
        absent = {drone for status in self.fresh.values() for drone in _left_out(status.report)}
        obeyed = [status.report for drone, status in self.fresh.items() if not self._rests(drone, absent)]
        missions = _obeyed(obeyed) or _obeyed([status.report for status in self.fresh.values()])
        older = {version for mission in missions if not rank(mission) for version in mission.knows}
        newest = [mission for mission in missions if mission.version not in older]
        return max(newest, key=_precedence, default=None)

    def flown(self) -> Mission | None:
        """Return the order by which drones are in a formation, None if none is."""
        flown = [status.report.mission for status in self.fresh.values() if status.report.phase == Phase.FORMATION]
        return max((one for one in flown if one is not None and one.in_formation), key=_precedence, default=None)

    def rival(self, order: Mission) -> Report | None:
        """Return the report of a pilot that obeys another, concurrent upward order, or of a gateway that repeats it."""
        rivals = [
            status.report
            for status in (*self.fresh.values(), *self._gateway)
            if (other := status.report.mission) is not None
            and not rank(other)
            and other.version != order.version
            and other.version not in order.knows
            and order.version not in other.knows
        ]
        return max(rivals, key=lambda one: one.mission.giver if one.mission is not None else 0, default=None)

    def reports(self) -> list[tuple[str, Report]]:
        """Return identity and report of the processes whose orders a new order must name.

        These are all pilots and, of other processes like the gateway, those with an upward order. A downward order that
        has reached no pilot is not named, because it is not in force yet.
        """
        flying, found = frozenset(self.pilots.values()), list[tuple[str, Report]]()
        for identity, status in self._statuses.items():
            if not status.report.newest or self.now - status.stamp >= STALE:
                continue
            if identity in flying or not rank(status.report.mission):
                found.append((identity, status.report))
        return found

    def unconfirmed(self, order: Mission) -> tuple[str, ...]:
        """Return the pilots that have not confirmed exactly this order."""
        return tuple(pilot for drone, pilot in self.pilots.items() if not self._obeys(drone, order))

    def lacking(self, order: Mission) -> tuple[str, ...]:
        """Return who is to get this order again: unconfirmed pilots, and a gateway that repeats another one or none."""
        others = [status.identity for status in self._gateway if not _received(status.report, order)]
        return (*self.unconfirmed(order), *others)

    def overruled(self, order: Mission) -> Mission | None:
        """Return an order in force for a pilot that names `order` and so ends it; None if there is none."""
        missions = (status.report.mission for status in self.fresh.values())
        return next((one for one in missions if one is not None and order.version in one.knows), None)

    def restarted(self, order: Mission) -> bool:
        """Return whether every pilot obeys an upward order that names `order`, a landing: it came after all were down.

        Those that it leaves out must be known to be down.
        """
        return all(
            drone in self.fresh
            and (mission := self.fresh[drone].report.mission) is not None
            and not rank(mission)
            and mission.verb != "prepare"
            and order.version in mission.knows
            and (drone not in mission.without or self._is_down(drone, 0))
            for drone in self.pilots
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

    def _is_down(self, drone: int, since: int) -> bool:
        state = self.states.get(drone)
        return state is not None and state not in IN_THE_AIR and self._telemetry[drone].stamp > since

    def _obeys(self, drone: int, order: Mission) -> bool:
        if drone not in self.fresh:
            return False
        report = self.fresh[drone].report
        if report.mission is None or not _received(report, order):
            return False
        down = order.verb == "hold" and report.phase in ON_GROUND  # pilots that do not know it do not take off
        return down or report.mission.verb == order.verb

    def _rests(self, drone: int, absent: Collection[int]) -> bool:
        """Return whether a drone is on the ground because it was left out, or landed since its upward order."""
        report = self.fresh[drone].report
        if drone in absent and report.phase in ON_GROUND:
            return True
        return (
            report.mission is not None and not rank(report.mission) and came_down(report.mission) in report.concurrent
        )


def unrecorded(recorders: Iterable[str], statuses: Mapping[str, Status]) -> str:
    """Return which recorder could not record the whole flight by its last status, empty when all could."""
    reports = {identity: statuses[identity].report for identity in recorders if identity in statuses}
    return "; ".join(f"{identity}: {last.detail}" for identity, last in reports.items() if last.phase == Phase.FULL)


def _received(report: Report, order: Mission) -> bool:
    """Return whether a process has received `order`, or its repetition by a station that knew it."""
    mission = report.mission
    if mission is not None and mission.stamp == order.stamp and mission.giver == order.giver:
        return True
    return order.version in report.concurrent or (mission is not None and _is_again(mission, order))


def _is_again(mission: Mission, order: Mission) -> bool:
    """Return whether `mission` repeats `order`, given by a station that knew it."""
    given = order._replace(stamp=mission.stamp, giver=mission.giver, knows=mission.knows)
    return mission == given and order.version in mission.knows


def _left_out(report: Report) -> tuple[int, ...]:
    return report.mission.without if report.mission is not None and not rank(report.mission) else ()


def _obeyed(reports: list[Report]) -> list[Mission]:
    return [report.mission for report in reports if report.mission is not None]


def _precedence(mission: Mission) -> tuple[int, int, int, int]:
    return (rank(mission), mission.giver, mission.stamp, mission.start)
