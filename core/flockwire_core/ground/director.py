"""Conducts a flight: takes off when all are ready, starts when all hold, lands when the time is over.

It relies on messages, not on silence: an order is repeated until every pilot has confirmed it and the gateway, which
repeats it for processes that start later, has it. A flight ends when the telemetry of every drone reports that it is
down.
"""

from __future__ import annotations

from enum import StrEnum

from flockwire_core.domain.order import IN_FORMATION, Mission, Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.first_places import with_first_places
from flockwire_core.ground.fleet import FLYING, STALE, Fleet, Lost
from flockwire_core.ground.order_log import KnownOrders
from flockwire_core.ground.preflight import problems
from flockwire_core.pilot.orders import rank
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan

POLL_PERIOD = 0.05  # s between two checks of the statuses

LEAD_TIME = SECOND // 2  # ns from the start order to the formation's time 0, so that all start together
STAGE_TIME = 30 * SECOND  # ns, time limit of a stage beside its climb or descent
GRACE = SECOND  # ns for which a pilot may seem lost: one restarted in flight, or all after this process was frozen
REPEAT = SECOND // 10  # ns between two repetitions of an unconfirmed order


class Stage(StrEnum):
    """The stage of a flight."""

    PREPARING = "preparing"
    TAKING_OFF = "taking off"
    FLYING = "in formation"
    LANDING = "landing"
    OVER = "over"


LOST = {Stage.TAKING_OFF: "did not take off", Stage.FLYING: "left the formation"}  # what a lost drone did
UNDER_WAY = (Stage.TAKING_OFF, Stage.FLYING)


class Director:
    """Conducts the flight of `plan` that `order` starts, from take-off to landing, asked for at `asked` (Unix ns).

    It begins at the time and in the state of `fleet`, as an order to land may come before the first step.

    It lands after `duration` s (0: when ordered). It follows a hold or a landing that others ordered after `asked`. A
    pilot may seem lost for `grace` ns before all land. No drone takes off while a pre-flight check fails. The drones
    `order.without` stay on the ground. `giver` is the unique number of its orders.
    """

    def __init__(
        self, plan: Plan, order: Order, giver: int, asked: int, fleet: Fleet, duration: float = 0.0, grace: int = GRACE
    ) -> None:
        self.stage = Stage.PREPARING
        self.failure = ""
        self.took_off: int | None = None  # time of the take-off order, Unix ns
        self._swarm, self._formation, self._without = plan.swarm, order.formation, order.without
        self._lost = Lost(grace)
        self._duration = nanoseconds(duration)
        self._since = self._took_off = fleet.now
        self._fleet = fleet.without(order.without)  # at the last step
        self._sent = 0  # last publication of the newest order, Unix ns; 0: none
        self._known = KnownOrders(giver, asked)

    @property
    def formation_start(self) -> int | None:
        """Time 0 of the flight: that of the formation's start, Unix ns; None before it is ordered."""
        started = self._known.started
        return None if started is None else started.start

    def step(self, fleet: Fleet) -> Mission | None:
        """Return the due order for the state of the whole swarm, or a repetition of an unconfirmed one."""
        fleet, now, known = fleet.without(self._without), fleet.now, self._known
        self._fleet = fleet
        if known.read(fleet):
            self._follow_down(fleet)
        self._settle(now)
        order = self._next(fleet) or self._out_of_patience(fleet) or self._unconfirmed(fleet)
        if order is not None:
            self._sent = now
        return order

    def land(self, now: int) -> Mission | None:
        """Return the order to land, None if no take-off was ordered and no drone flies: the flight is over."""
        if self.stage is Stage.OVER or (self.stage is Stage.PREPARING and not self._others_fly):
            self.stage = Stage.OVER
            return None
        return self._go(Stage.LANDING, self._mission(now, "land"))

    def hold(self, now: int) -> Mission | None:
        """Return the order to hold, None if no drone flies; during take-off no formation follows it."""
        if self.stage in UNDER_WAY or (self.stage is Stage.PREPARING and self._others_fly):
            return self._go(self.stage, self._mission(now, "hold"))
        return None

    def resume(self, now: int) -> Mission | None:
        """Return the order to fly the formation, None if no drone flies; the time of a started one continues.

        During take-off it is the take-off order again, for a pilot that restarted on the ground.
        """
        if self.stage not in UNDER_WAY:
            return None
        if (started := self._known.started) is not None:
            absent = tuple(sorted({*started.without, *self._without}))
            order = started._replace(stamp=now, verb="start", without=absent)
        else:
            order = self._mission(now, "takeoff") if self.stage is Stage.TAKING_OFF else self._start(now)
        return self._go(self.stage, order)

    def unready(self, fleet: Fleet) -> tuple[str, ...]:
        """Return a sentence for a gateway without poses, each pilot that is not ready, and each failed check."""
        return (*fleet.gateway_problem(), *fleet.others_than(Phase.READY, *FLYING), *problems(self._swarm, fleet))

    def stop(self, now: int) -> None:
        """Record an emergency stop: the flight has failed, and ends when no drone flies; one that is over stays so."""
        if self.stage is Stage.OVER:
            return
        self.failure = self.failure or "emergency stop"
        self.stage, self._since, self._known.order = Stage.LANDING, now, None

    def abort(self, reason: str, now: int) -> Mission | None:
        """Land because of `reason`, which becomes the flight's failure; before take-off, end without an order."""
        self.failure = self.failure or reason
        if self.stage is Stage.PREPARING:
            self.stage = Stage.OVER
            return None
        return self.land(now) if self.stage is not Stage.LANDING else None

    @property
    def _others_fly(self) -> bool:
        """Whether a drone flies, or was ordered to by another station, before this flight took off."""
        log = self._fleet.mission()
        return self._fleet.flies or (log is not None and log.verb in ("takeoff", *IN_FORMATION))

    @property
    def order(self) -> Mission | None:
        """The newest order, this flight's own or another operator's; None before the first."""
        return self._known.order

    @property
    def followed(self) -> Mission | None:
        """The newest order if another station gave it, else None."""
        return None if self._known.is_own else self.order

    @property
    def ordered(self) -> str:
        """The verb of the newest order; empty before the first."""
        return self.order.verb if self.order is not None else ""

    @property
    def since(self) -> int:
        """The start of the stage, or the arrival of the newest order, Unix ns."""
        return max(self._since, self._known.since)

    def _next(self, fleet: Fleet) -> Mission | None:
        """Return the order that starts the next stage, None during the stage."""
        if self.stage is Stage.PREPARING:  # drones may fly by an order that is not in the log yet
            known = fleet.order_age is not None and not self._known.is_unclear(fleet.now)
            return self._take_off(fleet) if known else None
        if self.stage in UNDER_WAY:
            return self._fly(fleet)
        if self.stage is Stage.LANDING and self._is_down(fleet):
            self.stage = Stage.OVER
        return None

    def _fly(self, fleet: Fleet) -> Mission | None:
        """Return the order that starts the formation, or ends the flight, None if none is due."""
        now = fleet.now
        if self.stage is Stage.TAKING_OFF:
            if self.ordered in ("takeoff", "prepare") and fleet.all_in(Phase.HOLD):
                return self._go(Stage.FLYING, self._start(now))
            if fleet.all_in(Phase.FORMATION) or (self.ordered == "hold" and fleet.all_in(Phase.HOLD)):
                self.stage, self._since = Stage.FLYING, now  # the last drone joined the others
        lost = self._lost.first(fleet, self.stage is Stage.TAKING_OFF)
        if lost is not None:
            return self.abort(f"{fleet.pilots[lost]} {LOST[self.stage]}: {fleet.reason_of_loss(lost)}", now)
        over = self.stage is Stage.FLYING and 0 < self._duration <= now - self._took_off
        return self.land(now) if over else None

    def _is_down(self, fleet: Fleet) -> bool:
        """Return whether the landing is over: all are down, and no pilot obeys an earlier order."""
        if self.order is not None and fleet.restarted(self.order):
            return True
        if fleet.not_down(self._since):
            return False
        confirmed = self.order is None or not fleet.unconfirmed(self.order)
        return confirmed or fleet.now - self._since >= STALE

    def _take_off(self, fleet: Fleet) -> Mission | None:
        """Return the order that takes all off; a drone that joins a flying formation gets its restart."""
        now, running = fleet.now, fleet.flown()
        if self.ordered == "hold" or any(fleet.phase(drone) == Phase.LANDING for drone in fleet.pilots):
            return None  # an order would end their landing
        if self._without and self.order is None and (order := self._left_out(running, now)) is not None:
            return self._go(self.stage, order)
        if not fleet.all_in(Phase.READY, Phase.HOLD, Phase.FORMATION):
            return None
        if problems(self._swarm, fleet):
            return None
        self._took_off = self.took_off = now
        if running is not None:
            return self._go(Stage.TAKING_OFF, running._replace(stamp=now, verb="start", without=self._without))
        return self._go(Stage.TAKING_OFF, self._mission(now, "takeoff"))

    def _left_out(self, running: Mission | None, now: int) -> Mission | None:
        """Return the order by which pilots know the drones that are left out, None if those `running` know them."""
        if running is None:
            return self._mission(now, "prepare")
        if set(self._without) <= set(running.without):
            return None
        return running._replace(stamp=now, verb="formation", without=self._without)

    def _start(self, now: int) -> Mission:
        """Return the order to start the formation, so that all start together."""
        order = self._mission(now, "start", now + LEAD_TIME, self._formation)
        return with_first_places(order, self._swarm, self._fleet)

    def _mission(self, now: int, verb: str, start: int = 0, formation: str = "") -> Mission:
        return Mission(now, self._swarm.frame, verb, start, formation, without=self._without)

    def _settle(self, now: int) -> None:
        """Follow another's upward order that the log has in place of this flight's, or give this one's again."""
        was = self.order
        if self.stage in (Stage.LANDING, Stage.OVER):
            return
        self._known.settle(now)
        if self.order is was or self.order is None:
            return
        self._since, self._sent = now, 0
        if self.stage is Stage.FLYING and self.ordered in ("takeoff", "prepare"):  # its start was not accepted
            self.stage = Stage.TAKING_OFF

    def _follow_down(self, fleet: Fleet) -> None:
        """Follow a hold or a landing of another giver. Before its own first order, one that was replaced ends it."""
        own, news = self.order, fleet.mission()
        if news is None or self.stage is Stage.OVER or (own is None and self.stage is not Stage.PREPARING):
            return
        if not rank(news):  # an upward order followed it
            self.stage = Stage.OVER if own is None else self.stage
            return
        if own is not None and 0 < rank(news) < rank(own):  # a hold does not cancel a landing
            return
        self._known.follow(news, fleet.now)
        grounded = self.stage is Stage.PREPARING and not fleet.flies  # a hold there: no drone may take off
        if news.verb == "land" or grounded:
            self.stage, self._since = Stage.LANDING, fleet.now
        elif self.stage is Stage.PREPARING:
            self.stage = Stage.TAKING_OFF
            self._since = self._took_off = self.took_off = fleet.now

    def _go(self, stage: Stage, order: Mission) -> Mission:
        """Give `order`, which starts or continues `stage`."""
        order = self._known.give(order)
        self.stage, self._since, self._sent = stage, order.stamp, 0
        return order

    def _patience(self) -> int:
        """Return the time limit of the stage, ns: with the longest climb or descent, unless it is on the ground."""
        return STAGE_TIME + (0 if self.stage is Stage.PREPARING else nanoseconds(self._swarm.climb_time))

    def _unconfirmed(self, fleet: Fleet) -> Mission | None:
        """Return the newest order if it is to be repeated; who only follows another's repeats no upward one."""
        order = self.order
        if order is None or self.stage is Stage.OVER or fleet.now - self._sent < REPEAT:
            return None
        return order if (self._known.is_own or rank(order)) and fleet.lacking(order) else None

    def _out_of_patience(self, fleet: Fleet) -> Mission | None:
        """End a stage that takes too long, which no formation does; return the order for that."""
        was = self.stage
        if was in (Stage.FLYING, Stage.OVER) or fleet.now - self._since <= self._patience():
            return None
        if was is Stage.LANDING:
            why: tuple[str, ...] = (f"not known to be down: {', '.join(fleet.not_down(self._since))}",)
        else:
            why = self.unready(fleet) if was is Stage.PREPARING else fleet.others_than(Phase.HOLD)
        order = self.abort(f"still {was} after {self._patience() // SECOND} s ({'; '.join(why)})", fleet.now)
        if was is Stage.LANDING:
            self.stage = Stage.OVER
        return order
