"""Finds drones of a flight that no longer fly, without an order."""

from __future__ import annotations

from flockwire_core.domain.airframe import FlightState
from flockwire_core.ground.fleet import IN_THE_AIR, Fleet
from flockwire_core.wire.phase import Phase

FLYING = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION})
DOWN_STATES = (FlightState.GROUNDED, FlightState.STOPPED)


class Lost:
    """Watches the drones of one flight; each may seem lost for `grace` ns before it is."""

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
        if phase in FLYING and state not in DOWN_STATES:
            self._since.pop(drone, None)
            return False
        since = self._since.setdefault(drone, fleet.now)
        by_itself = phase == Phase.STOPPED or (phase == Phase.LANDING and drone not in fleet.unclear())
        return by_itself or fleet.now - since >= self._grace


def reason_of_loss(fleet: Fleet, drone: int) -> str:
    """Return why a drone no longer flies."""
    stopped = drone in fleet.fresh and fleet.has_stopped(drone)
    return "its motors stopped" if stopped else fleet.why(drone)
