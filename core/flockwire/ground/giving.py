"""One order of one station, from the moment it is asked for until it is answered: sent, repeated, confirmed or not.

No order waits for anybody: who is dead, frozen or cut off is named in the answer. A landing, a hold and a stop are sent
at the first step, whatever is known; a change of formation is made from what the pilots report.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from flockwire.control.graph import LEADER
from flockwire.domain.order import Mission, Stop
from flockwire.domain.time import SECOND
from flockwire.ground.director import LEAD_TIME
from flockwire.ground.fleet import Fleet
from flockwire.ground.order import Answer, Order, ToPlan, overtaken
from flockwire.ground.standing import Standing
from flockwire.pilot.orders import DOWN, rank
from flockwire.swarm.model import uav
from flockwire.wire.phase import Phase
from flockwire.wire.plan import Plan

ANSWER_TIME = 3 * SECOND  # ns in which everybody should have confirmed an order
DOWN_TIME = 5 * SECOND  # ns in which the state of a drone should show that its motors are off
STOP_TIME = 2 * SECOND  # ns for which a stop is repeated at least, whoever has confirmed it
LOOK_TIME = 3 * SECOND // 2  # ns to look round before an order that depends on what the swarm does


class Giving(ABC):
    """One order to the swarm of `plan`, asked for at `asked` (Unix ns), with `giver` as its number.

    `answer` is there when it is over; a stop is repeated for a while after that. Where `to_plan` is not None, `planned`
    is to be called with the result.
    """

    def __init__(self, plan: Plan, order: Order, giver: int, asked: int) -> None:
        self.answer: Answer | None = None
        self.to_plan: ToPlan | None = None
        self._plan, self._order = plan, order
        self._giver, self._asked = giver, asked
        self._standing = Standing(giver, asked)
        self._began: int | None = None

    def step(self, fleet: Fleet) -> Mission | Stop | None:
        """Return what is to be published now, by what is known of the whole swarm."""
        self._began = fleet.now if self._began is None else self._began
        present = fleet.present()
        return self._step(present, self._standing.look(present), fleet.now - self._began)

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        raise NotImplementedError

    @abstractmethod
    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | Stop | None:
        """Do as `step`; `news` is another's order, `since` counts from the first step, ns."""

    def _answer(self, fleet: Fleet, missing: tuple[str, ...], refusal: str = "", note: str = "") -> None:
        confirmed = tuple(pilot for pilot in fleet.pilots.values() if pilot not in missing)
        self.answer = Answer(confirmed, missing, refusal, note)

    def _repeat(self, mission: Mission, fleet: Fleet, note: str = "") -> Mission | None:
        """Return `mission` again, and answer when all obey it, time is up, or another order took its place."""
        missing, late = fleet.unconfirmed(mission), fleet.now - self._standing.since >= ANSWER_TIME
        stronger = fleet.overruled(mission) or self._stronger(mission)
        if not missing:
            self._answer(fleet, missing, note=note)
        elif stronger is not None and (rank(mission) == 0 or late):
            reason = f"{stronger.verb} holds for {', '.join(missing)}, ordered meanwhile or by another station"
            self._answer(fleet, missing, reason)
        elif late:
            self._answer(fleet, missing)
        return mission if self.answer is None else None

    def _stronger(self, mission: Mission) -> Mission | None:
        """Return the order that holds where it outranks `mission`, which was not made from it."""
        holding = self._standing.holding
        if holding is None or rank(holding) <= rank(mission):
            return None
        return holding if rank(mission) or holding.version not in mission.knows else None


class StopGiving(Giving):
    """Stops the motors of every drone; telemetry confirms that a driver has the order, and then that they are off.

    The stop is repeated at each step until it is answered, and for STOP_TIME at least.
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
    """Changes to another formation, whose time continues, in the air alone; refused where it cannot be flown."""

    _from: Mission | None = None  # the order that the change is made from
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
        elif self._from is None and has_looked(fleet, since):
            self._begin(fleet, self._standing.holding)
        return None

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        flying = any(fleet.phase(i) in (Phase.FORMATION, Phase.HOLD) for i in self._plan.pilots)
        if running is None or running.verb == "land" or not flying:
            self.answer = Answer(refusal="no drone flies a formation; `flockwire start --formation NAME` takes off")
            return
        self._from, formation = running, self._order.formation
        if not running.start:  # they hold since they took off
            start, frame = fleet.now + LEAD_TIME, self._plan.swarm.frame
            self._planned = Mission(fleet.now, frame, "formation", start, formation, without=running.without)
            return
        leader = fleet.fresh.get(LEADER)
        position = leader.report.position if leader is not None else None
        self.to_plan = ToPlan(running, formation, position, self._order.duration)

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        self.to_plan, self._planned = None, mission
        if mission is None:
            self.answer = Answer(refusal=refusal)
        elif mission.change is not None and self._from is not None and mission.change != self._from.change:
            self._note = f"the change takes {mission.change.duration:.1f} s"


def has_looked(fleet: Fleet, since: int) -> bool:
    """Return whether an order that depends on what the swarm does has looked round, `since` ns after its first step."""
    return since >= LOOK_TIME or len(fleet.fresh) == len(fleet.pilots)
