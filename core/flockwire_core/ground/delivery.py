"""One order of one station, from its request to its answer: sent, repeated, confirmed or not.

An order does not wait for dead, frozen or cut off processes: the answer names them. A landing, a hold and a stop are
sent at the first step; a change of formation is made from the pilots' reports.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from itertools import filterfalse

from flockwire_core.domain.order import ENDING, Answer, Mission, Order, Stop, overtaken
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.director import LEAD_TIME, Director, Stage
from flockwire_core.ground.first_places import with_first_places, with_held_places
from flockwire_core.ground.fleet import FLYING, GATEWAY_SILENT, IN_THE_AIR, Fleet
from flockwire_core.ground.order_log import KnownOrders
from flockwire_core.pilot.orders import UNNUMBERED, rank
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan

ANSWER_TIME = 3 * SECOND  # ns for the confirmation of an order
DOWN_TIME = 5 * SECOND  # ns for a drone's state to show that its motors are off
READY_TIME = 5 * SECOND  # ns for all starting drones to be ready
STOP_TIME = 2 * SECOND  # ns, shortest repetition of a stop, even if confirmed
LOOK_TIME = 3 * SECOND // 2  # ns to observe the swarm before an order that depends on its state

Answered = Callable[[Answer], None]


class OrderDelivery(ABC):
    """One `order` to the swarm of `plan`, requested at `asked`, with `giver` as its number.

    It is known here since `since` (Unix ns; default: `asked`). `answer` is set at its end, and `answered` is then
    called with it (OperatorCore); a stop is repeated for a while after that.
    """

    def __init__(
        self,
        plan: Plan,
        order: Order,
        giver: int,
        asked: int,
        since: int | None = None,
        answered: Answered = lambda _: None,
    ) -> None:
        self.order, self.answered = order, answered
        self.answer: Answer | None = None
        self.is_answered = False
        self._plan, self._giver = plan, giver
        self._asked, self._since = asked, asked if since is None else since
        self._known = KnownOrders(giver, asked)
        self._began: int | None = None

    def correct(self, by: int) -> None:
        """Record that swarm time jumps ahead by `by` ns (back if negative): that time has not passed."""
        self._asked, self._since = self._asked + by, self._since + by
        if self._began is None:
            self._known = KnownOrders(self._giver, self._asked)
        else:
            self._began, self._known.since = self._began + by, self._known.since + by

    def may_wait(self, now: int) -> bool:
        """Return whether it may wait for swarm time at `now` (Unix ns)."""
        return self._began is None and self.order.verb not in ENDING and now - self._since < LOOK_TIME

    def step(self, fleet: Fleet) -> Mission | Stop | None:
        """Return the messages to publish now, for the state of the whole swarm."""
        self._began = fleet.now if self._began is None else self._began
        present = fleet.present()
        return self._step(present, self._known.read(present), fleet.now - self._began)

    @abstractmethod
    def _step(self, fleet: Fleet, news: str, since: int) -> Mission | Stop | None:
        """Return the due message; `news` is another's hold or landing, if any, `since` counts from step 1, ns."""

    def _answer(self, fleet: Fleet, missing: tuple[str, ...], refusal: str = "", note: str = "") -> None:
        confirmed = tuple(pilot for pilot in fleet.pilots.values() if pilot not in missing)
        self.answer = Answer(confirmed, missing, refusal, note)

    def _repeat(self, mission: Mission, fleet: Fleet, note: str = "") -> Mission | None:
        """Return `mission` again; answer if all have it, the time is over, or another order replaced it."""
        missing, late = fleet.unconfirmed(mission), fleet.now - self._known.since >= ANSWER_TIME
        stronger = fleet.stronger(mission)
        if not missing:
            lacking = ", ".join(fleet.lacking(mission))
            if late or not lacking:
                unheard = f"not received by {lacking}, which repeats orders for processes that start later"
                self._answer(fleet, missing, note=unheard if lacking else note)
        elif stronger is not None and (rank(mission) == 0 or late):
            reason = f"{stronger.verb} holds for {', '.join(missing)}, ordered meanwhile or by another station"
            self._answer(fleet, missing, reason)
        elif late:
            held = () if rank(mission) else fleet.unnumbered(missing)
            self._answer(fleet, missing, f"{', '.join(held)}: {UNNUMBERED}" if held else "")
        return mission if self.answer is None else None


class StopDelivery(OrderDelivery):
    """Stops the motors of every drone; telemetry confirms the receipt, then that the motors are off.

    The stop is repeated at each step until it is answered, and at least for STOP_TIME.
    """

    def _step(self, fleet: Fleet, news: str, since: int) -> Stop | None:
        self.answer = self.answer or self._confirmed(fleet, since)
        if self.answer is not None and since >= STOP_TIME:
            return None
        return Stop(fleet.now, self._plan.swarm.frame, self.order.reason)

    def _confirmed(self, fleet: Fleet, since: int) -> Answer | None:
        """Return the answer once all motors are known to be off, or the time for that is over."""
        received = tuple(filter(fleet.received_stop, self._plan.pilots))
        missing = tuple(map(uav, filterfalse(fleet.received_stop, self._plan.pilots)))
        turning = tuple(map(uav, filterfalse(fleet.has_stopped, received)))
        if since < (ANSWER_TIME if missing else DOWN_TIME if turning else 0):
            return None
        answer = Answer(tuple(map(uav, received)), missing)
        late = f"{answer.failure}; " if missing else ""
        told = f"{late}received by {', '.join(turning)}, not known to be down yet"
        return answer._replace(refusal=told) if turning else answer


class DownDelivery(OrderDelivery):
    """Orders to hold or to land, at once."""

    def _step(self, fleet: Fleet, news: str, since: int) -> Mission | None:
        new = Mission(fleet.now, self._plan.swarm.frame, self.order.verb)
        return self._repeat(self._known.order or self._known.give(new), fleet)


class ChangeDelivery(OrderDelivery):
    """Changes to another formation, whose time continues, only in the air; refused if it cannot be flown.

    If `to_plan` is not None, the change from that order to the formation of `order` is to be planned, which takes
    longer than a step may, with the `leader` there (m, world frame): call `planned` with the result.
    """

    to_plan: Mission | None = None
    leader: Vector | None = None
    _from: Mission | None = None  # the order before the change
    _planned: Mission | None = None
    _note = ""

    def _step(self, fleet: Fleet, news: str, since: int) -> Mission | None:
        own = self._known.order
        if news:
            self.answer = overtaken(news)
        elif own is not None:
            self._known.settle(fleet.now)
            own = self._known.order or own
            if self._known.is_own:
                return self._repeat(own, fleet, self._note)
            self.answer = overtaken(own.verb)
        elif self._planned is not None:
            return self._known.give(self._planned)
        elif self._from is None and not self._known.is_unclear(fleet.now) and self._has_looked(fleet, since):
            self._begin(fleet, fleet.mission())
        return None

    def _has_looked(self, fleet: Fleet, since: int) -> bool:
        return since >= LOOK_TIME or (fleet.order_age is not None and len(fleet.fresh) == len(fleet.pilots))

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        if fleet.order_age is None:
            self.answer = Answer(refusal=GATEWAY_SILENT)
            return
        flying = any(fleet.phase(i) in (Phase.FORMATION, Phase.HOLD) for i in self._plan.pilots)
        if running is None or running.verb == "land" or not flying:
            self.answer = Answer(refusal="no drone flies a formation; `flockwire start --formation NAME` takes off")
            return
        self._from, formation = running, self.order.formation
        if not running.start:  # they have held since take-off
            start, frame = fleet.now + LEAD_TIME, self._plan.swarm.frame
            order = Mission(fleet.now, frame, "formation", start, formation, without=running.without)
            self._planned = with_first_places(order, self._plan.swarm, fleet)
            return
        leader = self._plan.swarm.sole_leader
        self.leader = fleet.position(self._plan.pilot[leader]) if leader is not None else None  # it may have no drone
        held = with_held_places(running, self._plan.swarm, fleet) if formation != running.formation else running
        if held is None:
            self.answer = Answer(refusal="the places that the drones hold by the auction are not known; start again")
            return
        self.to_plan = held

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        self.to_plan, self._planned = None, mission
        if mission is None:
            self.answer = Answer(refusal=refusal)
        elif mission.change is not None and self._from is not None and mission.change != self._from.change:
            by_auction = mission.formation in self._plan.swarm.auctioned
            rehearsed = "; rehearsed with the best places, the followers' auction decides" if by_auction else ""
            self._note = f"the change takes {mission.change.duration:.1f} s{rehearsed}"


class StartDelivery(ChangeDelivery):
    """Takes off if necessary, then starts the formation; drones on the ground join a flying formation.

    If all already fly another formation, it changes the formation.
    """

    _director: Director | None = None

    def step(self, fleet: Fleet) -> Mission | Stop | None:
        """Return the messages to publish now, for the state of the whole swarm."""
        order = super().step(fleet)
        if self._director is None or self.answer is not None:
            return order
        wanted = fleet.without(self.order.without)
        order = self._director.step(wanted)
        self._judge(self._director, wanted, fleet.now - (self._began or fleet.now))
        return order if self.answer is None else None

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        order = self.order
        wanted = {drone: pilot for drone, pilot in self._plan.pilots.items() if drone not in order.without}
        if self._director is not None:
            return
        if airborne := [uav(drone) for drone in order.without if fleet.states.get(drone) in IN_THE_AIR]:
            self.answer = Answer(refusal=f"{', '.join(airborne)} cannot be left out in the air; land first")
        elif running is None or not all(fleet.phase(drone) == Phase.FORMATION for drone in wanted):
            self._director = Director(self._plan, order, self._giver, self._asked, fleet)
        elif running.formation == order.formation:
            self.answer = Answer(tuple(wanted.values()))
        else:
            super()._begin(fleet, running)

    def _judge(self, director: Director, fleet: Fleet, since: int) -> None:
        order = director.order
        if director.failure or (order is not None and order.verb in ENDING):
            hover = "; the others stay in the air: `flockwire land` lands them" if fleet.flies else ""
            self.answer = Answer(refusal=director.failure + hover) if director.failure else overtaken(director.ordered)
        elif director.stage is Stage.PREPARING and since >= LOOK_TIME + READY_TIME:
            self.answer = Answer(refusal=_not_ready(director, fleet))
        elif director.stage is Stage.FLYING and order is not None:
            self._judge_flight(order, fleet, fleet.now - director.since)

    def _judge_flight(self, order: Mission, fleet: Fleet, since: int) -> None:
        missing = fleet.unconfirmed(order)
        late = tuple(p for i, p in fleet.pilots.items() if p in missing or fleet.phase(i) != Phase.FORMATION)
        if not late and order.formation != self.order.formation:
            self.answer = Answer(refusal="another formation was ordered meanwhile, by another station")
        elif not (late or fleet.lacking(order)) or since >= ANSWER_TIME + LEAD_TIME:
            self._answer(fleet, late)


def _not_ready(director: Director, fleet: Fleet) -> str:
    remedy = " (`--without ID` flies without a drone)" if fleet.others_than(Phase.READY, *FLYING) else ""
    return f"not ready: {'; '.join(director.unready(fleet))}{remedy}"
