"""Conducts a flight as an operator would: take off when all are ready, start when all hold, land when time is up.

It believes what it receives, not silence: an order is repeated until every pilot has confirmed it, and a flight is over
when the telemetry of every drone reports that it is down.
"""

from __future__ import annotations

from enum import StrEnum

from flockwire.domain.order import IN_FORMATION, Mission
from flockwire.domain.time import SECOND, nanoseconds
from flockwire.ground.fleet import STALE, Fleet
from flockwire.ground.lost import FLYING, Lost, how
from flockwire.ground.order import Order
from flockwire.ground.preflight import Preflight
from flockwire.ground.standing import Standing
from flockwire.pilot.orders import rank
from flockwire.wire.phase import Phase
from flockwire.wire.plan import Plan

POLL_PERIOD = 0.05  # s between two looks at the statuses

LEAD_TIME = SECOND // 2  # ns from the order to start until the formation's time 0, so that all begin together
STAGE_TIME = 30 * SECOND  # ns that a stage may take
GRACE = SECOND  # ns that a pilot may seem lost: one restarted in flight, or all after this process was frozen
REPEAT = SECOND // 10  # ns between two repetitions of an order that somebody has not confirmed


class Stage(StrEnum):
    """How far a flight is."""

    PREPARING = "preparing"
    TAKING_OFF = "taking off"
    FLYING = "in formation"
    LANDING = "landing"
    OVER = "over"


UNDER_WAY = (Stage.TAKING_OFF, Stage.FLYING)


class Director:
    """Conducts the flight of `plan` that `order` starts, from take-off to landing, asked for at `asked` (Unix ns).

    It lands after `duration` s (0: when ordered). A hold or a landing that others ordered after `asked` counts. A pilot
    may seem lost for `grace` ns before all land. Nobody takes off while the pre-flight checks have a reason against it.
    The drones `order.without` stay on the ground. `giver` numbers its orders: no other has the same.
    """

    def __init__(
        self, plan: Plan, order: Order, giver: int, asked: int, now: int, duration: float = 0.0, grace: int = GRACE
    ) -> None:
        self.stage = Stage.PREPARING
        self.failure = ""
        self.took_off: int | None = None  # when the order to take off was given, Unix ns
        self._frame, self._formation, self._without = plan.swarm.frame, order.formation, order.without
        self._preflight, self._lost = Preflight.of(plan.swarm), Lost(grace)
        self._duration = nanoseconds(duration)
        self._since = self._took_off = now
        self._aloft = False  # something flew at the last step
        self._sent = 0  # when the newest order was published last, Unix ns; 0: not yet
        self._standing = Standing(giver, asked)

    def step(self, fleet: Fleet) -> Mission | None:
        """Return the order that is due by what is known of the whole swarm, or again because not all confirmed it."""
        fleet, now, standing = fleet.without(self._without), fleet.now, self._standing
        self._aloft = fleet.flies
        self._adopt(standing.look(fleet), fleet)
        if self.stage is not Stage.LANDING and standing.settle(fleet):
            self._since = now
        order = self._next(fleet)
        if order is None and self.stage not in (Stage.FLYING, Stage.OVER) and now - self._since > STAGE_TIME:
            order = self._out_of_patience(fleet)
        if order is None and standing.order is not None and self.stage is not Stage.OVER and now - self._sent >= REPEAT:
            order = self._again(standing.order, fleet) if fleet.unconfirmed(standing.order) else None
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
        """Return the order to fly the formation, None when nobody flies; the time of one that was started continues.

        During take-off, that to take off again: it brings in a pilot that was restarted on the ground.
        """
        if self.stage not in UNDER_WAY:
            return None
        if (started := self._standing.started) is not None:
            absent = tuple(sorted({*started.without, *self._without}))
            order = started._replace(stamp=now, verb="start", without=absent)
        else:
            order = self._mission(now, "takeoff") if self.stage is Stage.TAKING_OFF else self._start(now)
        return self._go(self.stage, order)

    def unready(self, fleet: Fleet) -> tuple[str, ...]:
        """Return a sentence for each pilot that could not take off, and for what else is against it."""
        return (*fleet.others_than(Phase.READY, *FLYING), *self._preflight.reasons(fleet))

    def stop(self, now: int) -> None:
        """Take note of an emergency stop: the flight has failed, and is over when nothing flies."""
        self.failure = self.failure or "emergency stop"
        self.stage, self._since, self._standing.order = Stage.LANDING, now, None

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
        holding = self._standing.holding
        return self._aloft or (holding is not None and holding.verb in ("takeoff", *IN_FORMATION))

    @property
    def order(self) -> Mission | None:
        """The newest order, this flight's own or another operator's; None before the first."""
        return self._standing.order

    @property
    def ordered(self) -> str:
        """The verb of the newest order; empty before the first."""
        return self.order.verb if self.order is not None else ""

    @property
    def since(self) -> int:
        """When the stage began, or the newest order came, Unix ns."""
        return max(self._since, self._standing.since)

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
            lost = self._lost.first(fleet, self.stage is Stage.TAKING_OFF)
            if lost is not None:
                what = "left the formation" if self.stage is Stage.FLYING else "did not take off"
                return self.abort(f"{fleet.pilots[lost]} {what}: {how(fleet, lost)}", now)
        if self.stage is Stage.FLYING and self._duration and now - self._took_off >= self._duration:
            return self.land(now)
        if self.stage is Stage.LANDING and not fleet.not_down(self._since) and self._settled(fleet):
            self.stage = Stage.OVER
        return None

    def _settled(self, fleet: Fleet) -> bool:
        """Return whether nobody obeys an order from before the landing: all confirmed this one, or are long silent."""
        return self.order is None or not fleet.unconfirmed(self.order) or fleet.now - self._since >= STALE

    def _take_off(self, fleet: Fleet) -> Mission | None:
        """Return the order that takes all off; a drone that joins a flying formation gets its restart."""
        now, running = fleet.now, fleet.flown()
        if self.ordered == "hold":
            return None
        if self._without and self.order is None:  # who would wait for those left out must know
            return self._go(self.stage, self._mission(now, "prepare"))
        if not fleet.all_in(Phase.READY, Phase.HOLD, Phase.FORMATION) or self._preflight.reasons(fleet):
            return None
        self._took_off = self.took_off = now
        if running is not None:
            return self._go(Stage.TAKING_OFF, running._replace(stamp=now, verb="start", without=self._without))
        return self._go(Stage.TAKING_OFF, self._mission(now, "takeoff"))

    def _start(self, now: int) -> Mission:
        """Return the order to start the formation, so that all begin it together."""
        return self._mission(now, "start", now + LEAD_TIME, self._formation)

    def _mission(self, now: int, verb: str, start: int = 0, formation: str = "") -> Mission:
        return Mission(now, self._frame, verb, start, formation, without=self._without)

    def _adopt(self, news: Mission | None, fleet: Fleet) -> None:
        """Take another's order for this flight's. Before any of its own, only a hold and a landing count."""
        own = self.order
        if news is None or (own is None and self.stage is not Stage.PREPARING):
            return
        if rank(news) == 0 and (own is None or self.stage is Stage.LANDING):
            return
        if own is not None and 0 < rank(news) < rank(own):  # a hold takes no landing back
            return
        if own is not None and own.version not in news.knows and rank(own) >= rank(news):
            return  # it is repeated until all obey it; of two that take up at once Standing.settle decides
        self._standing.follow(news, fleet.now)
        grounded = self.stage is Stage.PREPARING and not self._aloft  # a hold there: nobody is to take off
        if self.stage is not Stage.OVER and (news.verb == "land" or (news.verb == "hold" and grounded)):
            self.stage, self._since = Stage.LANDING, fleet.now
        elif news.verb == "hold" and self.stage is Stage.PREPARING:
            self.stage = Stage.TAKING_OFF
            self._since = self._took_off = self.took_off = fleet.now

    def _again(self, order: Mission, fleet: Fleet) -> Mission:
        """Return `order` to be repeated: another's that some do not obey for long is given once more, as its own."""
        if self._standing.is_own or rank(order) or fleet.now - self._standing.since < GRACE:
            return order
        return self._go(self.stage, order._replace(stamp=fleet.now))

    def _go(self, stage: Stage, order: Mission) -> Mission:
        """Give `order`, with which `stage` begins, or continues."""
        order = self._standing.give(order)
        self.stage, self._since, self._sent = stage, order.stamp, 0
        return order

    def _out_of_patience(self, fleet: Fleet) -> Mission | None:
        was = self.stage
        if was is Stage.LANDING:
            why: tuple[str, ...] = (f"not known to be down: {', '.join(fleet.not_down(self._since))}",)
        else:
            why = self.unready(fleet) if was is Stage.PREPARING else fleet.others_than(Phase.HOLD)
        order = self.abort(f"still {was} after {STAGE_TIME // SECOND} s ({'; '.join(why)})", fleet.now)
        if was is Stage.LANDING:
            self.stage = Stage.OVER
        return order
