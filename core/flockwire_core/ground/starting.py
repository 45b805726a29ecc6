"""The start order, from its request until all fly: it takes off if necessary."""

from __future__ import annotations

from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.director import LEAD_TIME, Director, Stage
from flockwire_core.ground.fleet import IN_THE_AIR, Fleet
from flockwire_core.ground.giving import ANSWER_TIME, LOOK_TIME, ChangeGiving
from flockwire_core.ground.order import ENDING, Answer, overtaken
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import Phase

READY_TIME = 5 * SECOND  # ns for all starting drones to be ready


class StartGiving(ChangeGiving):
    """Takes off if necessary, then starts the formation; drones on the ground join a flying formation.

    If all already fly another formation, it changes the formation.
    """

    _director: Director | None = None

    def step(self, fleet: Fleet) -> Mission | Stop | None:
        """Return the messages to publish now, for the state of the whole swarm."""
        order = super().step(fleet)
        if self._director is None or self.answer is not None:
            return order
        wanted = fleet.without(self._order.without)
        order = self._director.step(wanted)
        self._judge(self._director, wanted, fleet.now - (self._began or fleet.now))
        return order if self.answer is None else None

    def _begin(self, fleet: Fleet, running: Mission | None) -> None:
        order = self._order
        wanted = {drone: pilot for drone, pilot in self._plan.pilots.items() if drone not in order.without}
        if self._director is not None:
            return
        if airborne := [uav(drone) for drone in order.without if fleet.states.get(drone) in IN_THE_AIR]:
            self.answer = Answer(refusal=f"{', '.join(airborne)} cannot be left out in the air; land first")
        elif running is None or not all(fleet.phase(drone) == Phase.FORMATION for drone in wanted):
            self._director = Director(self._plan, order, self._giver, self._asked, fleet.now)
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
            why = "; ".join(director.unready(fleet))
            self.answer = Answer(refusal=f"not ready: {why} (`--without ID` flies without a drone)")
        elif director.stage is Stage.FLYING and order is not None:
            missing = fleet.unconfirmed(order)
            late = tuple(p for i, p in fleet.pilots.items() if p in missing or fleet.phase(i) != Phase.FORMATION)
            if not late and order.formation != self._order.formation:
                self.answer = Answer(refusal="another formation was ordered meanwhile, by another station")
            elif not (late or fleet.lacking(order)) or fleet.now - director.since >= ANSWER_TIME + LEAD_TIME:
                self._answer(fleet, late)
