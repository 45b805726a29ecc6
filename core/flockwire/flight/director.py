"""Conducts a flight as an operator would: take off when all are ready, start when all hold, land when time is up.

It believes what it receives, not silence: an order is repeated until every pilot has confirmed it, and a flight is over
when the telemetry of every drone reports that it is down.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from flockwire.flight.fleet import IN_THE_AIR, STALE, Fleet
from flockwire.flight.phases import Phase
from flockwire.flight.preflight import Preflight
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import FlightState, Mission, Telemetry
from flockwire.wire.status import Status

POLL_PERIOD = 0.05  # s between two looks at the statuses

LEAD_TIME = BILLION // 2  # ns from the order to start until the formation's time 0, so that all begin together
PATIENCE = 30 * BILLION  # ns that a stage may take
GRACE = BILLION  # ns that a pilot may seem lost: one restarted in flight, or all after this process stood still
REPEAT = BILLION // 10  # ns between two repetitions of an order that somebody has not confirmed
STOP_FOR = 2 * BILLION  # ns for which an operator repeats an emergency stop
FLYING = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION})


class Stage(StrEnum):
    """How far a flight is."""

    PREPARING = "preparing"
    TAKING_OFF = "taking off"
    FLYING = "in formation"
    LANDING = "landing"
    OVER = "over"


UNDER_WAY = (Stage.TAKING_OFF, Stage.FLYING)


class Director:
    """Conducts the flight of `pilots` (by drone) for `duration` s from take-off to landing (0: until ordered).

    A pilot may seem lost for `grace` ns before all land. Nobody takes off while `preflight` has a reason against it.
    The drones `without` stay on the ground.
    """

    def __init__(
        self,
        pilots: Mapping[int, str],
        frame: str,
        duration: float,
        now: int,
        formation: str = "",
        grace: int = GRACE,
        preflight: Preflight = Preflight(),  # noqa: B008  (it is frozen)
        without: tuple[int, ...] = (),
    ) -> None:
        self.stage = Stage.PREPARING
        self.failure = ""
        self.took_off: int | None = None  # when the order to take off was given, Unix ns
        self.pilots = {drone: pilot for drone, pilot in pilots.items() if drone not in without}
        self._frame, self._formation, self._without = frame, formation, without
        self._preflight = preflight
        self._duration, self._grace = round(duration * BILLION), grace
        self._since = self._took_off = now
        self._lost_since: dict[int, int] = {}
        self._rose: set[int] = set()  # the drones that followed the order to take off
        self._aloft = False  # something flew at the last step
        self._order: Mission | None = None  # the newest, its own or another operator's
        self._started: Mission | None = None  # the newest order to start
        self._sent = 0

    def step(self, statuses: Mapping[str, Status], telemetry: Mapping[int, Telemetry], now: int) -> Mission | None:
        """Return the order that is due at `now` (Unix ns), or again because not all confirmed it; else None."""
        fleet = Fleet(self.pilots, statuses, telemetry, now)
        self._aloft = any(state in IN_THE_AIR for state in fleet.states.values())
        self._heed_others(fleet)
        order = self._next(fleet)
        if order is None and self.stage not in (Stage.FLYING, Stage.OVER) and now - self._since > PATIENCE:
            order = self._out_of_patience(fleet)
        if order is None and self._order is not None and self.stage is not Stage.OVER and now - self._sent >= REPEAT:
            order = self._order if fleet.unconfirmed(self._order) else None
        if order is not None:
            self._sent = now
        return order

    def land(self, now: int) -> Mission | None:
        """Return the order to land, None when nobody was ordered to take off and nothing flies: the flight is over."""
        if self.stage is Stage.OVER or (self.stage is Stage.PREPARING and not self._aloft):
            self.stage = Stage.OVER
            return None
        return self._go(Stage.LANDING, self._mission(now, "land"))

    def hold(self, now: int) -> Mission | None:
        """Return the order to hold, None when nobody flies; given during take-off, no formation follows it."""
        return self._go(self.stage, self._mission(now, "hold")) if self.stage in UNDER_WAY else None

    def resume(self, now: int) -> Mission | None:
        """Return the order to fly the formation, None when nobody flies; the time of one that was started goes on.

        During take-off, that to take off again: it brings in a pilot that was restarted on the ground.
        """
        if self.stage not in UNDER_WAY:
            return None
        if self._started is not None:
            order = self._started._replace(stamp=now, verb="start")
        else:
            order = self._mission(now, "takeoff") if self.stage is Stage.TAKING_OFF else self._start(now)
        return self._go(self.stage, order)

    def change(self, order: Mission) -> Mission | None:
        """Return `order`, a planned change of formation, None when nobody flies."""
        return self._go(self.stage, order) if self.stage is Stage.FLYING else None

    def unready(self, statuses: Mapping[str, Status], telemetry: Mapping[int, Telemetry], now: int) -> tuple[str, ...]:
        """Return a sentence for each pilot that could not take off at `now`, and for what else is against it."""
        fleet = Fleet(self.pilots, statuses, telemetry, now)
        late = [drone for drone in self.pilots if fleet.phase(drone) not in (Phase.READY, *FLYING)]
        return (*(f"{self.pilots[drone]}: {fleet.why(drone)}" for drone in late), *self._preflight.reasons(fleet))

    def stop(self, now: int) -> None:
        """Take note of an emergency stop: the flight has failed, and is over when nothing flies."""
        self.failure = self.failure or "emergency stop"
        self.stage, self._since, self._order = Stage.LANDING, now, None

    def abort(self, reason: str, now: int) -> Mission | None:
        """Land because of `reason`, which becomes the flight's failure; before take-off, end without an order."""
        self.failure = self.failure or reason
        if self.stage is Stage.PREPARING:
            self.stage = Stage.OVER
            return None
        return self.land(now) if self.stage is not Stage.LANDING else None

    @property
    def ordered(self) -> str:
        """The verb of the newest order, this flight's own or another operator's; empty before the first."""
        return self._order.verb if self._order is not None else ""

    def _next(self, fleet: Fleet) -> Mission | None:
        """Return the order with which the next stage begins, None while the stage lasts."""
        now = fleet.now
        if self.stage is Stage.PREPARING:
            return self._take_off(fleet)
        if self.stage is Stage.TAKING_OFF and fleet.all_in(Phase.HOLD):
            if self.ordered != "hold":
                return self._go(Stage.FLYING, self._start(now))
            self.stage, self._since = Stage.FLYING, now
        if self.stage is Stage.TAKING_OFF and fleet.all_in(Phase.FORMATION):  # the last joined a formation that flew
            self.stage, self._since = Stage.FLYING, now
        if self.stage in UNDER_WAY:
            lost = next((drone for drone in self.pilots if self._is_lost(fleet, drone)), None)
            if lost is not None:
                what = "left the formation" if self.stage is Stage.FLYING else "did not take off"
                return self.abort(f"{self.pilots[lost]} {what}: {self._how(fleet, lost)}", now)
        if self.stage is Stage.FLYING and self._duration and now - self._took_off >= self._duration:
            return self.land(now)
        if self.stage is Stage.LANDING and not fleet.not_down(self._since) and self._settled(fleet):
            self.stage = Stage.OVER
        return None

    def _settled(self, fleet: Fleet) -> bool:
        """Return whether nobody obeys an order from before the landing: all confirmed this one, or are long silent."""
        return self._order is None or not fleet.unconfirmed(self._order) or fleet.now - self._since >= STALE

    def _take_off(self, fleet: Fleet) -> Mission | None:
        """Return the order that brings all into the air; who joins a formation that flies gets its start again."""
        now, running = fleet.now, fleet.mission()
        if self._without and self._order is None:  # who would wait for those left out must know
            return self._go(self.stage, self._mission(now, "prepare"))
        if not fleet.all_in(Phase.READY, Phase.HOLD, Phase.FORMATION) or self._preflight.reasons(fleet):
            return None
        self._took_off = self.took_off = now
        if running is not None and any(fleet.phase(drone) == Phase.FORMATION for drone in self.pilots):
            return self._go(Stage.TAKING_OFF, running._replace(stamp=now, verb="start", without=self._without))
        return self._go(Stage.TAKING_OFF, self._mission(now, "takeoff"))

    def _start(self, now: int) -> Mission:
        """Return the order to start the formation, so that all begin it together."""
        return self._mission(now, "start", now + LEAD_TIME, self._formation)

    def _mission(self, now: int, verb: str, start: int = 0, formation: str = "") -> Mission:
        return Mission(now, self._frame, verb, start, formation, without=self._without)

    def _heed_others(self, fleet: Fleet) -> None:
        """Take another operator's newer order for this flight's; before any of its own, only one to hold or to land."""
        mission = fleet.mission()
        if mission is None or mission.stamp <= (self._order.stamp if self._order is not None else self._since):
            return
        if self._order is None and (self.stage is not Stage.PREPARING or mission.verb not in ("hold", "land")):
            return
        self._order = mission
        self._started = mission if mission.in_formation else self._started
        grounded = self.stage is Stage.PREPARING and not self._aloft  # a hold there: nobody is to take off
        if self.stage is not Stage.OVER and (mission.verb == "land" or (mission.verb == "hold" and grounded)):
            self.stage, self._since = Stage.LANDING, fleet.now
        elif mission.verb == "hold" and self.stage is Stage.PREPARING:
            self.stage = Stage.TAKING_OFF
            self._since = self._took_off = self.took_off = fleet.now

    def _is_lost(self, fleet: Fleet, drone: int) -> bool:
        """Return whether a drone flies no more, by its status or telemetry; one that has not taken off yet waits."""
        silent, phase, state = drone not in fleet.fresh, fleet.phase(drone), fleet.states.get(drone)
        down = state in (FlightState.GROUNDED, FlightState.STOPPED)
        if phase in FLYING and state in IN_THE_AIR:
            self._rose.add(drone)
        if self.stage is Stage.TAKING_OFF and not silent and drone not in self._rose:
            return False
        if not (silent or down or phase not in FLYING):
            self._lost_since.pop(drone, None)
            return False
        since = self._lost_since.setdefault(drone, fleet.now)
        return phase in (Phase.LANDING, Phase.STOPPED) or fleet.now - since >= self._grace

    def _how(self, fleet: Fleet, drone: int) -> str:
        state = fleet.states.get(drone)
        if drone in fleet.fresh and state is FlightState.STOPPED:
            return "its motors stopped"
        return fleet.why(drone)

    def _go(self, stage: Stage, order: Mission) -> Mission:
        self.stage, self._since, self._order = stage, order.stamp, order
        self._started = order if order.in_formation else self._started
        return order

    def _out_of_patience(self, fleet: Fleet) -> Mission | None:
        wanted = {Stage.PREPARING: Phase.READY, Stage.TAKING_OFF: Phase.HOLD}.get(self.stage)
        if wanted is None:
            reasons = f"not known to be down: {', '.join(fleet.not_down(self._since))}"
        else:
            late = [drone for drone in self.pilots if fleet.phase(drone) != wanted]
            why = [f"{self.pilots[drone]}: {fleet.why(drone)}" for drone in late]
            against = self._preflight.reasons(fleet) if self.stage is Stage.PREPARING else ()
            reasons = "; ".join([*why, *against])
        was = self.stage
        order = self.abort(f"still {was} after {PATIENCE // BILLION} s ({reasons})", fleet.now)
        if was is Stage.LANDING:
            self.stage = Stage.OVER
        return order
