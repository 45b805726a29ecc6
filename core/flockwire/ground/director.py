"""Conducts a flight as an operator would: take off when all are ready, start when all hold, land when time is up.

It believes what it receives, not silence: an order is repeated until every pilot has confirmed it, and a flight is over
when the telemetry of every drone reports that it is down.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from flockwire.domain.time import SECOND, nanoseconds
from flockwire.ground.fleet import IN_THE_AIR, STALE, Fleet
from flockwire.ground.knowledge import Knowledge
from flockwire.ground.preflight import Preflight
from flockwire.pilot.orders import rank
from flockwire.wire.messages import IN_FORMATION, FlightState, Mission, Telemetry
from flockwire.wire.phase import Phase
from flockwire.wire.status import Status

POLL_PERIOD = 0.05  # s between two looks at the statuses

LEAD_TIME = SECOND // 2  # ns from the order to start until the formation's time 0, so that all begin together
STAGE_TIME = 30 * SECOND  # ns that a stage may take
GRACE = SECOND  # ns that a pilot may seem lost: one restarted in flight, or all after this process stood still
REPEAT = SECOND // 10  # ns between two repetitions of an order that somebody has not confirmed
RIVALS = 4.0  # s by which an order may be older than one that crossed it on slow networks
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

    A hold or a landing that others ordered after it was `asked` for (Unix ns, default: `now`) counts. A pilot may seem
    lost for `grace` ns before all land. Nobody takes off while `preflight` has a reason against it. The drones
    `without` stay on the ground. `giver` numbers its orders: no other has the same.
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
        giver: int = 0,
        asked: int | None = None,
    ) -> None:
        self.stage = Stage.PREPARING
        self.failure = ""
        self.took_off: int | None = None  # when the order to take off was given, Unix ns
        self.pilots = {drone: pilot for drone, pilot in pilots.items() if drone not in without}
        self._frame, self._formation, self._without = frame, formation, without
        self._preflight = preflight
        self._duration, self._grace = nanoseconds(duration), grace
        self._since = self._took_off = now
        self._lost_since: dict[int, int] = {}
        self._rose: set[int] = set()  # the drones that followed the order to take off
        self._aloft = False  # something flew at the last step
        self._order: Mission | None = None  # the newest, its own or another operator's
        self._started: Mission | None = None  # the newest order to start
        self._adopted = now  # when the newest order became this flight's, Unix ns
        self._sent = 0
        self._giver, self._knowledge = giver, Knowledge(giver, now if asked is None else asked)

    def step(self, statuses: Mapping[str, Status], telemetry: Mapping[int, Telemetry], now: int) -> Mission | None:
        """Return the order that is due at `now` (Unix ns), or again because not all confirmed it; else None."""
        fleet = Fleet(self.pilots, statuses, telemetry, now)
        self._aloft = any(state in IN_THE_AIR for state in fleet.states.values())
        self._adopt(self._knowledge.look(fleet), fleet)
        self._settle_rivals(fleet)
        order = self._next(fleet)
        if order is None and self.stage not in (Stage.FLYING, Stage.OVER) and now - self._since > STAGE_TIME:
            order = self._out_of_patience(fleet)
        if order is None and self._order is not None and self.stage is not Stage.OVER and now - self._sent >= REPEAT:
            order = self._again(self._order, fleet) if fleet.unconfirmed(self._order) else None
        if order is not None:
            self._sent = now
        return order

    def land(self, now: int) -> Mission | None:
        """Return the order to land, None when nobody was ordered to take off and nothing flies: the flight is over."""
        if self.stage is Stage.OVER or (self.stage is Stage.PREPARING and not self._others_fly):
            self.stage = Stage.OVER
            return None
        return self._go(Stage.LANDING, self._mission(now, "land"))

    def hold(self, now: int) -> Mission | None:
        """Return the order to hold, None when nobody flies; given during take-off, no formation follows it."""
        if self.stage in UNDER_WAY or (self.stage is Stage.PREPARING and self._others_fly):
            return self._go(self.stage, self._mission(now, "hold"))
        return None

    def resume(self, now: int) -> Mission | None:
        """Return the order to fly the formation, None when nobody flies; the time of one that was started goes on.

        During take-off, that to take off again: it brings in a pilot that was restarted on the ground.
        """
        if self.stage not in UNDER_WAY:
            return None
        if self._started is not None:
            absent = tuple(sorted({*self._started.without, *self._without}))
            order = self._knowledge.give(self._started._replace(stamp=now, verb="start", without=absent))
        else:
            order = self._mission(now, "takeoff") if self.stage is Stage.TAKING_OFF else self._start(now)
        return self._go(self.stage, order)

    def change(self, order: Mission, running: Mission) -> Mission | None:
        """Return `order`, a change of formation planned from `running`; None when that holds no more."""
        holding = self._knowledge.holding
        if self.stage is not Stage.FLYING or holding is None or holding.version != running.version:
            return None
        return self._go(self.stage, self._knowledge.give(order))

    def unready(self, fleet: Fleet) -> tuple[str, ...]:
        """Return a sentence for each pilot that could not take off, and for what else is against it."""
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
    def _others_fly(self) -> bool:
        """Whether something flies, or was ordered to by another station, before this flight took off."""
        holding = self._knowledge.holding
        return self._aloft or (holding is not None and holding.verb in ("takeoff", *IN_FORMATION))

    @property
    def order(self) -> Mission | None:
        """The newest order, this flight's own or another operator's; None before the first."""
        return self._order

    @property
    def ordered(self) -> str:
        """The verb of the newest order; empty before the first."""
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
        now, running = fleet.now, fleet.flown()
        if self.ordered == "hold":
            return None
        if self._without and self._order is None:  # who would wait for those left out must know
            return self._go(self.stage, self._mission(now, "prepare"))
        if not fleet.all_in(Phase.READY, Phase.HOLD, Phase.FORMATION) or self._preflight.reasons(fleet):
            return None
        self._took_off = self.took_off = now
        if running is not None:
            joining = running._replace(stamp=now, verb="start", without=self._without)
            return self._go(Stage.TAKING_OFF, self._knowledge.give(joining))
        return self._go(Stage.TAKING_OFF, self._mission(now, "takeoff"))

    def _start(self, now: int) -> Mission:
        """Return the order to start the formation, so that all begin it together."""
        return self._mission(now, "start", now + LEAD_TIME, self._formation)

    def _mission(self, now: int, verb: str, start: int = 0, formation: str = "") -> Mission:
        return self._knowledge.give(Mission(now, self._frame, verb, start, formation, without=self._without))

    def _adopt(self, news: Mission | None, fleet: Fleet) -> None:
        """Take another's order for this flight's. Before any of its own, only a hold and a landing count."""
        own = self._order
        if news is None or (own is None and self.stage is not Stage.PREPARING):
            return
        if rank(news) == 0 and (own is None or self.stage is Stage.LANDING):
            return
        if own is not None and 0 < rank(news) < rank(own):  # a hold takes no landing back
            return
        if own is not None and own.version not in news.knows and rank(own) >= rank(news):
            return  # it is repeated until all obey it; of two that take up at once `_settle_rivals` decides
        self._follow(news, fleet.now)
        grounded = self.stage is Stage.PREPARING and not self._aloft  # a hold there: nobody is to take off
        if self.stage is not Stage.OVER and (news.verb == "land" or (news.verb == "hold" and grounded)):
            self.stage, self._since = Stage.LANDING, fleet.now
        elif news.verb == "hold" and self.stage is Stage.PREPARING:
            self.stage = Stage.TAKING_OFF
            self._since = self._took_off = self.took_off = fleet.now

    def _settle_rivals(self, fleet: Fleet) -> None:
        """Where some pilots obey another order that takes up, have the one with the larger number hold for all.

        It is given again, from what both ordered. What a pilot obeys for much longer is no rival: it was away.
        """
        own = self._order
        if own is None or rank(own) or self.stage is Stage.LANDING or (rival := fleet.rival(own)) is None:
            return
        other, since = rival.mission, (fleet.now - self._adopted) / SECOND
        if other is None:
            return
        if other.giver > own.giver and rival.order_age < since + RIVALS:
            self._follow(other, fleet.now)
        elif own.giver == self._giver:
            self._go(self.stage, self._knowledge.give(own._replace(stamp=fleet.now)))

    def _again(self, order: Mission, fleet: Fleet) -> Mission:
        """Return `order` to be repeated: another's that some do not obey for long is given once more, as its own."""
        if order.giver == self._giver or rank(order) or fleet.now - self._adopted < GRACE:
            return order
        return self._go(self.stage, self._knowledge.give(order._replace(stamp=fleet.now)))

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
        self.stage, self._since = stage, order.stamp
        self._follow(order, order.stamp)
        return order

    def _follow(self, order: Mission, now: int) -> None:
        """Take `order` for this flight's newest, since `now` (Unix ns)."""
        self._order, self._adopted = order, now
        self._started = order if order.in_formation else self._started

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
        order = self.abort(f"still {was} after {STAGE_TIME // SECOND} s ({reasons})", fleet.now)
        if was is Stage.LANDING:
            self.stage = Stage.OVER
        return order
