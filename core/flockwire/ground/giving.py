"""One order of one station, from the moment it is asked for until it is answered: sent, repeated, confirmed or not.

No order waits for anybody: who is dead, frozen or cut off is named in the answer. A landing, a hold and a stop are sent
at the first step, whatever is known; a start and a change of formation are made from what the pilots report.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

from flockwire.control.graph import LEADER
from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector
from flockwire.ground.director import LEAD_TIME, Director, Stage
from flockwire.ground.fleet import IN_THE_AIR, Fleet
from flockwire.ground.knowledge import Knowledge
from flockwire.ground.preflight import Preflight
from flockwire.pilot.orders import DOWN, rank
from flockwire.swarm.model import uav
from flockwire.wire.messages import Mission, Stop, Telemetry, Version
from flockwire.wire.phase import Phase
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status

Statuses = Mapping[str, Status]
ENDING = ("hold", "land", "stop")  # orders that end a start that is under way
ANSWER_TIME = 3 * SECOND  # ns in which everybody should have confirmed an order
DOWN_TIME = 5 * SECOND  # ns in which the state of a drone should show that its motors are off
READY_TIME = 5 * SECOND  # ns in which all that are to start must be ready
STOP_TIME = 2 * SECOND  # ns for which a stop is repeated at least, whoever has confirmed it
LOOK_TIME = 3 * SECOND // 2  # ns to look round before an order that depends on what the swarm does


class Order(NamedTuple):
    """One order, as an operator gives it.

    Args:
        verb: "start", "formation", "hold", "land" or "stop".
        formation: what a start or a change flies: a name from [formations], empty: the first formation.
        duration: s that a change takes, None: the shortest that keeps to all limits.
        without: the drones that a start leaves on the ground.
        reason: why the motors are to stop.

    """

    verb: str
    formation: str = ""
    duration: float | None = None
    without: tuple[int, ...] = ()
    reason: str = "the operator's order"


class Answer(NamedTuple):
    """Who confirmed an order, who did not, why (empty: not known), and what else is to be known of it."""

    confirmed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    refusal: str = ""
    note: str = ""


class ToPlan(NamedTuple):
    """A change of formation to be planned, which takes longer than a step may: arguments of `plan_in_time`."""

    running: Mission
    formation: str
    leader: Vector | None  # where the leader is, m, world frame
    duration: float | None  # s


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
        self._knowledge = Knowledge(giver, asked)
        self._began: int | None = None

    def step(self, statuses: Statuses, telemetry: Mapping[int, Telemetry], now: int) -> Mission | Stop | None:
        """Return what is to be published at `now` (Unix ns)."""
        self._began = now if self._began is None else self._began
        fleet = Fleet.present(self._plan.pilots, statuses, telemetry, now)
        return self._step(fleet, self._knowledge.look(fleet), now - self._began)

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        raise NotImplementedError

    @abstractmethod
    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | Stop | None:
        """Do as `step`; `news` is another's order, `since` counts from the first step, ns."""

    def _answer(self, fleet: Fleet, missing: tuple[str, ...], refusal: str = "", note: str = "") -> None:
        confirmed = tuple(pilot for pilot in fleet.pilots.values() if pilot not in missing)
        self.answer = Answer(confirmed, missing, refusal, note)


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


class MissionGiving(Giving):
    """Repeats one mission until every pilot obeys it."""

    def __init__(self, plan: Plan, order: Order, giver: int, asked: int) -> None:
        super().__init__(plan, order, giver, asked)
        self._mission: Mission | None = None
        self._note = ""

    def _repeat(self, mission: Mission, fleet: Fleet, since: int) -> Mission | None:
        """Return `mission` again, and answer when all obey it, time is up, or another order took its place."""
        missing = fleet.unconfirmed(mission)
        stronger = fleet.overruled(mission) or self._stronger(mission)
        if not missing:
            self._answer(fleet, missing, note=self._note)
        elif stronger is not None and (rank(mission) == 0 or since >= ANSWER_TIME):
            reason = f"{stronger.verb} holds for {', '.join(missing)}, ordered meanwhile or by another station"
            self._answer(fleet, missing, reason)
        elif since >= ANSWER_TIME:
            self._answer(fleet, missing)
        return mission if self.answer is None else None

    def _stronger(self, mission: Mission) -> Mission | None:
        """Return the order that holds where it outranks `mission`, which was not made from it."""
        holding = self._knowledge.holding
        if holding is None or rank(holding) <= rank(mission):
            return None
        return holding if rank(mission) or holding.version not in mission.knows else None


class DownGiving(MissionGiving):
    """Orders to hold or to land, at once."""

    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | None:
        if self._mission is None:
            self._mission = self._knowledge.give(Mission(fleet.now, self._plan.swarm.frame, self._order.verb))
        return self._repeat(self._mission, fleet, since)


class ChangeGiving(MissionGiving):
    """Changes to another formation, whose time goes on, in the air alone; refused where it cannot be flown."""

    _from: Mission | None = None  # the order that the change is made from
    _given = 0  # when it was given, ns from the first step

    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> Mission | None:
        if news is not None and (news.verb in DOWN or not self._given):
            self.answer = Answer(refusal=f"{news.verb} was ordered meanwhile")
            return None
        if self._mission is None or not self._given:
            if self._mission is not None:
                self._given, self._mission = since, self._knowledge.give(self._mission)
            elif self._from is None and (since >= LOOK_TIME or len(fleet.fresh) == len(fleet.pilots)):
                self._begin(fleet, self._knowledge.holding)
            return self._mission if self._given else None
        rival = fleet.rival(self._mission)
        if rival is not None and rival.mission is not None:
            if rival.mission.giver > self._giver:
                reason = f"{rival.mission.verb} was ordered meanwhile"
                self._answer(fleet, fleet.unconfirmed(self._mission), reason)
                return None
            self._given, self._mission = since, self._knowledge.give(self._mission._replace(stamp=fleet.now))
        return self._repeat(self._mission, fleet, since - self._given)

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        flying = any(fleet.phase(i) in (Phase.FORMATION, Phase.HOLD) for i in self._plan.pilots)
        if running is None or running.verb == "land" or not flying:
            self.answer = Answer(refusal="no drone flies a formation; `flockwire start --formation NAME` takes off")
            return
        self._from = running
        if not running.start:  # they hold since they took off
            start = fleet.now + LEAD_TIME
            self._mission = Mission(
                fleet.now, self._plan.swarm.frame, "formation", start, self._order.formation, without=running.without
            )
            return
        leader = fleet.fresh.get(LEADER)
        position = leader.report.position if leader is not None else None
        self.to_plan = ToPlan(running, self._order.formation, position, self._order.duration)

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        self.to_plan = None
        if mission is None:
            self.answer = Answer(refusal=refusal)
            return
        self._mission, change = mission, mission.change
        if change is not None and self._from is not None and change != self._from.change:
            self._note = f"the change takes {change.duration:.1f} s"


class StartGiving(Giving):
    """Takes off where need be, then starts the formation; who is on the ground joins a formation that flies."""

    _director: Director | None = None
    _change: ChangeGiving | None = None
    _newest: Version | None = None  # the order to start
    _started = 0  # when that was given, ns from the first step

    def step(self, statuses: Statuses, telemetry: Mapping[int, Telemetry], now: int) -> Mission | Stop | None:
        """Return what is to be published at `now` (Unix ns)."""
        if self._change is not None:
            order = self._change.step(statuses, telemetry, now)
            self.answer, self.to_plan = self._change.answer, self._change.to_plan
            return order
        order = super().step(statuses, telemetry, now)
        if self._director is None or self.answer is not None:
            return order
        mission = self._director.step(statuses, telemetry, now)
        fleet = Fleet(self._director.pilots, statuses, telemetry, now)
        self._judge(self._director, fleet, now - (self._began or now))
        return mission if self.answer is None else None

    def planned(self, mission: Mission | None, refusal: str = "") -> None:
        """Take the change that was planned, or why there is none."""
        assert self._change is not None  # noqa: S101  (nothing else is planned)
        self._change.planned(mission, refusal)
        self.to_plan = None

    def _step(self, fleet: Fleet, news: Mission | None, since: int) -> None:
        if news is not None and news.verb in DOWN:
            self.answer = Answer(refusal=f"{news.verb} was ordered meanwhile")
        elif self._director is None and (since >= LOOK_TIME or len(fleet.fresh) == len(fleet.pilots)):
            self._begin(fleet, self._knowledge.holding)

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        plan, order = self._plan, self._order
        if airborne := [uav(drone) for drone in order.without if fleet.states.get(drone) in IN_THE_AIR]:
            self.answer = Answer(refusal=f"{', '.join(airborne)} cannot be left out in the air; land first")
            return
        wanted = [drone for drone in plan.pilots if drone not in order.without]
        if running is not None and all(fleet.phase(drone) == Phase.FORMATION for drone in wanted):
            if running.formation == order.formation:
                self.answer = Answer(tuple(plan.pilots[drone] for drone in wanted))
            else:
                self._change = ChangeGiving(plan, order, self._giver, self._asked)
            return
        self._director = Director(
            plan.pilots, plan.swarm.frame, 0.0, fleet.now, order.formation,
            preflight=Preflight.of(plan.swarm), without=order.without, giver=self._giver, asked=self._asked,
        )  # fmt: skip

    def _judge(self, director: Director, fleet: Fleet, since: int) -> None:
        if director.failure or director.ordered in ENDING:
            self.answer = Answer(refusal=director.failure or f"{director.ordered} was ordered meanwhile")
        elif director.stage is Stage.PREPARING and since >= LOOK_TIME + READY_TIME:
            why = "; ".join(director.unready(fleet))
            self.answer = Answer(refusal=f"not ready: {why} (`--without ID` flies without a drone)")
        elif director.stage is Stage.FLYING and director.order is not None:
            if director.order.version != self._newest:  # given again, or another's: all have as long again
                self._newest, self._started = director.order.version, since
            obeying = frozenset(director.pilots.values()).difference(fleet.unconfirmed(director.order))
            late = tuple(
                pilot
                for i, pilot in director.pilots.items()
                if pilot not in obeying or fleet.phase(i) != Phase.FORMATION
            )
            if not late and director.order.formation != self._order.formation:
                self.answer = Answer(refusal="another formation was ordered meanwhile, by another station")
            elif not late or since - self._started >= ANSWER_TIME + LEAD_TIME:
                self._answer(fleet, late)


GIVINGS: Mapping[str, type[Giving]] = {
    "start": StartGiving, "formation": ChangeGiving, "hold": DownGiving, "land": DownGiving, "stop": StopGiving,
}  # fmt: skip


def giving(plan: Plan, order: Order, giver: int, asked: int) -> Giving:
    """Return what gives `order` to the swarm of `plan`; the arguments are those of Giving."""
    return GIVINGS[order.verb](plan, order, giver, asked)
