"""One order of one station, from its request to its answer: sent, repeated, confirmed or not.

An order does not wait for dead, frozen or cut off processes: the answer names them. A landing, a hold and a stop are
sent at the first step; a change of formation is made from the pilots' reports.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from flockwire_core.control.graph import LEADER
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.director import LEAD_TIME
from flockwire_core.ground.first_places import with_first_places, with_held_places
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.order import Answer, Order, ToPlan, overtaken
from flockwire_core.ground.standing import Standing
from flockwire_core.pilot.orders import DOWN, rank
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan

ANSWER_TIME = 3 * SECOND  # ns for the confirmation of an order
DOWN_TIME = 5 * SECOND  # ns for a drone's state to show that its motors are off
STOP_TIME = 2 * SECOND  # ns, shortest repetition of a stop, even if confirmed
LOOK_TIME = 3 * SECOND // 2  # ns to observe the swarm before an order that depends on its state


class Giving(ABC):
    """One order to the swarm of `plan`, requested at `asked` (Unix ns), with `giver` as its number.

    `answer` is set at its end; a stop is repeated for a while after that. If `to_plan` is not None, call `planned` with
    the result.
    """

    def __init__(self, plan: Plan, order: Order, giver: int, asked: int) -> None:
        self.answer: Answer | None = None
        self.to_plan: ToPlan | None = None
        self._plan, self._order = plan, order
        self._giver, self._asked = giver, asked
        self._standing = Standing(giver, asked)
        self._began: int | None = None

    def step(self, fleet: Fleet) -> Mission | Stop | None:
        """Return the messages to publish now, for the state of the whole swarm."""
        self._began = fleet.now if self._began is None else self._began
        present = fleet.present()
        return self._step(present, self._standing.look(present), fleet.now - self._began)

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        raise NotImplementedError

    @abstractmethod
    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | Stop | None:
        """Return the messages for each kind of order; `news` is another's order, `since` counts from step 1, ns."""

    def _answer(self, fleet: Fleet, missing: tuple[str, ...], refusal: str = "", note: str = "") -> None:
        confirmed = tuple(pilot for pilot in fleet.pilots.values() if pilot not in missing)
        self.answer = Answer(confirmed, missing, refusal, note)

    def _repeat(self, mission: Mission, fleet: Fleet, note: str = "") -> Mission | None:
        """Return `mission` again; answer if all have it, the time is over, or another order replaced it."""
        missing, late = fleet.unconfirmed(mission), fleet.now - self._standing.since >= ANSWER_TIME
        stronger = fleet.overruled(mission) or self._stronger(mission)
        if not missing:
            lacking = ", ".join(fleet.lacking(mission))
            if late or not lacking:
                unheard = f"not received by {lacking}, which repeats orders for processes that start later"
                self._answer(fleet, missing, note=unheard if lacking else note)
        elif stronger is not None and (rank(mission) == 0 or late):
            reason = f"{stronger.verb} holds for {', '.join(missing)}, ordered meanwhile or by another station"
            self._answer(fleet, missing, reason)
        elif late:
            self._answer(fleet, missing)
        return mission if self.answer is None else None

    def _stronger(self, mission: Mission) -> Mission | None:
        """Return the order in force if it outranks `mission` and `mission` does not name it."""
        holding = self._standing.holding
        if holding is None or rank(holding) <= rank(mission):
            return None
        return holding if rank(mission) or holding.version not in mission.knows else None


class StopGiving(Giving):
    """Stops the motors of every drone; telemetry confirms the receipt, then that the motors are off.

    The stop is repeated at each step until it is answered, and at least for STOP_TIME.
    """

    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Stop | None:
        drones = self._plan.pilots
        received = tuple(uav(i) for i in drones if fleet.received_stop(i))
        unknown = ", ".join(uav(i) for i in drones if fleet.received_stop(i) and not fleet.has_stopped(i))
        missing = tuple(uav(i) for i in drones if not fleet.received_stop(i))
        if self.answer is None and (not (missing or unknown) or since >= (ANSWER_TIME if missing else DOWN_TIME)):
            late = f"sent, but not confirmed by {', '.join(missing)}" if missing else ""
            turning = f"received by {unknown}, not known to be down yet" if unknown else ""
            self.answer = Answer(received, missing, "; ".join(filter(None, (late, turning))) if turning else "")
        if self.answer is not None and since >= STOP_TIME:
            return None
        return Stop(fleet.now, self._plan.swarm.frame, self._order.reason)


class DownGiving(Giving):
    """Orders to hold or to land, at once."""

    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | None:
        own = self._standing.order
        if own is None:
            own = self._standing.give(Mission(fleet.now, self._plan.swarm.frame, self._order.verb))
        return self._repeat(own, fleet)


class ChangeGiving(Giving):
    """Changes to another formation, whose time continues, only in the air; refused if it cannot be flown."""

    _from: Mission | None = None  # the order before the change
    _planned: Mission | None = None
    _note = ""

    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | None:
        own = self._standing.order
        if news is not None and (news.verb in DOWN or (own is None and self._from is not None)):
            self.answer = overtaken(news.verb)
        elif own is not None:
            self._standing.settle(fleet)
            own = self._standing.order or own
            if self._standing.is_own:
                return self._repeat(own, fleet, self._note)
            self.answer = overtaken(own.verb)
        elif self._planned is not None:
            return self._standing.give(self._planned)
        elif self._from is None and not self._standing.unclear(fleet.now) and self._has_looked(fleet, since):
            self._begin(fleet, self._standing.holding)
        return None

    def _has_looked(self, fleet: Fleet, since: int) -> bool:
        return since >= LOOK_TIME or len(fleet.fresh) == len(fleet.pilots)

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        flying = any(fleet.phase(i) in (Phase.FORMATION, Phase.HOLD) for i in self._plan.pilots)
        if running is None or running.verb == "land" or not flying:
            self.answer = Answer(refusal="no drone flies a formation; `flockwire start --formation NAME` takes off")
            return
        self._from, formation = running, self._order.formation
        if not running.start:  # they have held since take-off
            start, frame = fleet.now + LEAD_TIME, self._plan.swarm.frame
            order = Mission(fleet.now, frame, "formation", start, formation, without=running.without)
            self._planned = with_first_places(order, self._plan.swarm, fleet)
            return
        position = fleet.position(self._plan.pilot[LEADER])  # a virtual or a tracked leader has no drone
        held = with_held_places(running, self._plan.swarm, fleet) if formation != running.formation else running
        if held is None:
            self.answer = Answer(refusal="the places that the drones hold by the auction are not known; start again")
            return
        self.to_plan = ToPlan(held, formation, position, self._order.duration)

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        self.to_plan, self._planned = None, mission
        if mission is None:
            self.answer = Answer(refusal=refusal)
        elif mission.change is not None and self._from is not None and mission.change != self._from.change:
            by_auction = mission.formation in self._plan.swarm.auctioned
            rehearsed = "; rehearsed with the best places, the followers' auction decides" if by_auction else ""
            self._note = f"the change takes {mission.change.duration:.1f} s{rehearsed}"
