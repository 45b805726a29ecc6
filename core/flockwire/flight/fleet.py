"""What an operator knows of a fleet: the newest status of each pilot and the newest telemetry of each drone."""

from __future__ import annotations

from collections.abc import Mapping

from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import uav
from flockwire.wire.messages import FlightState, Mission, Telemetry
from flockwire.wire.status import Status

STALE = 2 * BILLION  # ns after which a status or telemetry no longer counts
IN_THE_AIR = frozenset({FlightState.FLYING, FlightState.LANDING})


class Fleet:
    """What is known at `now` (Unix ns), by `statuses` of processes and `telemetry` of drones.

    `pilots` are the identities of those that fly the drones, by drone.
    """

    def __init__(
        self, pilots: Mapping[int, str], statuses: Mapping[str, Status], telemetry: Mapping[int, Telemetry], now: int
    ) -> None:
        self.pilots, self.now = pilots, now
        self._statuses, self._telemetry = statuses, telemetry
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

    def phase(self, drone: int) -> str | None:
        """Return the phase of the drone's pilot, None when it is silent."""
        return self.fresh[drone].report.phase if drone in self.fresh else None

    def all_in(self, *phases: Phase) -> bool:
        """Return whether every pilot is in one of `phases`."""
        return all(self.phase(drone) in phases for drone in self.pilots)

    def clocks_off(self, bound: float) -> dict[str, float]:
        """Return by how many s clocks may be wrong, by process, where that is more than `bound` or unknown (-1)."""
        fresh = [status for status in self._statuses.values() if self.now - status.stamp < STALE]
        return {s.identity: s.clock_bound for s in fresh if not 0.0 <= s.clock_bound <= bound}

    def mission(self) -> Mission | None:
        """Return the newest order that a pilot obeys; of a hold that of one who knows which formation it interrupts."""
        missions = [status.report.mission for status in self.fresh.values() if status.report.mission is not None]
        return max(missions, key=lambda mission: (mission.stamp, mission.start), default=None)

    def unconfirmed(self, order: Mission) -> tuple[str, ...]:
        """Return the pilots that have not confirmed that they obey `order`, or a newer one."""
        return tuple(pilot for drone, pilot in self.pilots.items() if not self._obeys(drone, order))

    def not_down(self, since: int = 0) -> tuple[str, ...]:
        """Return the drones that are in the air, or have not reported after `since` (Unix ns) that they are not."""
        return tuple(uav(drone) for drone in self.pilots if not self._is_down(drone, since))

    def why(self, drone: int) -> str:
        """Return what the drone's pilot reports of itself."""
        status = self._statuses.get(self.pilots[drone])
        if status is None:
            return "no status"
        return (status.report.detail or status.report.phase) if drone in self.fresh else "silent"

    def _is_down(self, drone: int, since: int) -> bool:
        state = self.states.get(drone)
        return state is not None and state not in IN_THE_AIR and self._telemetry[drone].stamp > since

    def _obeys(self, drone: int, order: Mission) -> bool:
        mission = self.fresh[drone].report.mission if drone in self.fresh else None
        return mission is not None and mission.stamp >= order.stamp
