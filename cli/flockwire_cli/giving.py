"""Giving one order to a swarm that runs: at once to those linked, again until confirmed; then who confirmed it.

No order waits for anybody. A process that is dead, frozen or cut off is named in the answer.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from flockwire import clock
from flockwire.control.graph import LEADER
from flockwire.flight.director import LEAD_TIME, POLL_PERIOD, Director, Stage
from flockwire.flight.fleet import IN_THE_AIR, Fleet
from flockwire.flight.phases import Phase
from flockwire.flight.preflight import Preflight
from flockwire.nanoseconds import BILLION
from flockwire.runtime.session import RouterAbsentError, Session
from flockwire.swarm.model import uav
from flockwire.wire.messages import FlightState, Mission, Stop
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_cli.operator import Operator
from flockwire_cli.order import Order

ENDING = ("hold", "land", "stop")  # orders that end a start that is under way
DELIBERATE = ("start", "formation")  # orders that may wait until the operator's own certificate is verified
REPEAT = 0.02  # s between two repetitions of an order
ANSWER_TIME = 3.0  # s in which everybody should have confirmed an order
READY_TIME = 5.0  # s in which all that are to start must be ready
LOOK_TIME = 1.5  # s to look round before an order that depends on what the swarm does


class Answer(NamedTuple):
    """Who confirmed an order, who did not, why nothing was ordered (empty: it was), and what is to be known of it."""

    confirmed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    refusal: str = ""
    note: str = ""


async def give(plan: Plan, keys: Path | None, order: Order) -> Answer:
    """Give one order as an operator of its own; raises CredentialsError."""
    try:
        session = Session(plan, OPERATOR.kind, keys, verified=order.verb in DELIBERATE)
    except RouterAbsentError:
        return Answer(refusal=f"the router at {plan.endpoints[plan.routers[0]]} does not answer")
    with session:
        return await obey(Operator(plan, session), plan, order)


async def obey(operator: Operator, plan: Plan, order: Order) -> Answer:
    """Give one order by an operator whose session is open, as `give` does."""
    if order.verb == "stop":
        return await _stop(operator, plan)
    await tell_time(operator)
    if order.verb == "start":
        return await _start(operator, plan, order)
    if order.verb == "formation":
        return await _change(operator, plan, order)
    return await _confirmed(operator, Mission(clock.now(), plan.swarm.frame, order.verb))


async def _stop(operator: Operator, plan: Plan) -> Answer:
    """Stop the motors of every drone; a driver confirms by telemetry."""

    def missing(fleet: Fleet) -> tuple[str, ...]:
        return tuple(uav(i) for i in plan.pilots if fleet.states.get(i) is not FlightState.STOPPED)

    def send() -> None:
        operator.order(Stop(clock.now(), plan.swarm.frame, "the operator's order"))

    left = await _repeated(operator, send, missing)
    return Answer(tuple(name for name in map(uav, plan.pilots) if name not in left), left)


async def _confirmed(operator: Operator, mission: Mission) -> Answer:
    """Publish `mission` until every pilot confirms that it obeys it, or ANSWER_TIME is over."""
    left = await _repeated(operator, lambda: operator.order(mission), lambda fleet: fleet.unconfirmed(mission))
    pilots = operator.fleet().pilots.values()
    return Answer(tuple(pilot for pilot in pilots if pilot not in left), left)


async def _repeated(
    operator: Operator, send: Callable[[], None], missing: Callable[[Fleet], tuple[str, ...]]
) -> tuple[str, ...]:
    deadline = clock.monotonic() + round(ANSWER_TIME * BILLION)
    while True:
        send()
        left = missing(operator.fleet())
        if not left or clock.monotonic() >= deadline:
            return left
        await asyncio.sleep(REPEAT)


async def _start(operator: Operator, plan: Plan, order: Order) -> Answer:
    """Take off where need be, then start the formation; who is on the ground joins a formation that flies."""
    formation, without = order.formation, order.without
    fleet = await _look_round(operator)
    running = fleet.mission()
    if aloft := [uav(drone) for drone in without if fleet.states.get(drone) in IN_THE_AIR]:
        return Answer(refusal=f"{', '.join(aloft)} cannot be left out in the air; land first")
    wanted = [drone for drone in plan.pilots if drone not in without]
    if running is not None and all(fleet.phase(drone) == Phase.FORMATION for drone in wanted):
        if running.formation == formation:
            return Answer(tuple(plan.pilots[drone] for drone in wanted))
        return await _change(operator, plan, order)
    ready = Preflight.of(plan.swarm)
    director = Director(plan.pilots, plan.swarm.frame, 0.0, clock.now(), formation, preflight=ready, without=without)
    deadline = clock.monotonic() + round(READY_TIME * BILLION)
    while director.stage not in (Stage.FLYING, Stage.OVER) and not director.failure and director.ordered not in ENDING:
        operator.order(director.step(operator.statuses, operator.telemetry, operator.poll()))
        if director.stage is Stage.PREPARING and clock.monotonic() > deadline:
            late = director.unready(operator.statuses, operator.telemetry, operator.poll())
            return Answer(refusal=f"not ready: {'; '.join(late)} (`--without ID` flies without a drone)")
        await asyncio.sleep(POLL_PERIOD)
    if director.failure or director.ordered in ENDING:
        return Answer(refusal=director.failure or f"{director.ordered} was ordered meanwhile")
    return await _started(operator, director)


async def _started(operator: Operator, director: Director) -> Answer:
    """Repeat the order to start until all have confirmed it."""
    deadline = clock.monotonic() + round(ANSWER_TIME * BILLION) + LEAD_TIME
    while clock.monotonic() < deadline:
        operator.order(director.step(operator.statuses, operator.telemetry, operator.poll()))
        fleet = operator.fleet()
        late = tuple(director.pilots[drone] for drone in director.pilots if fleet.phase(drone) != Phase.FORMATION)
        if not late:
            break
        await asyncio.sleep(POLL_PERIOD)
    return Answer(tuple(pilot for pilot in director.pilots.values() if pilot not in late), late)


async def _change(operator: Operator, plan: Plan, order: Order) -> Answer:
    """Change to another formation, whose time goes on, in the air alone; refused where it cannot be flown."""
    from flockwire.flight.formation_planning import ChangeRefusedError, plan_in_time  # noqa: PLC0415  (numpy)

    fleet = await _look_round(operator)
    running = fleet.mission()
    flying = any(fleet.phase(i) in (Phase.FORMATION, Phase.HOLD) for i in plan.pilots)
    if running is None or running.verb == "land" or not flying:
        return Answer(refusal="nobody flies a formation; `flockwire start --formation NAME` takes off")
    if not running.start:  # they hold since they took off
        now = clock.now()
        return await _confirmed(operator, Mission(now, plan.swarm.frame, "formation", now + LEAD_TIME, order.formation))
    leader = operator.statuses.get(plan.pilot[LEADER])
    position = leader.report.position if leader is not None else None
    try:
        mission = plan_in_time(plan.swarm, running, order.formation, clock.now, position, order.duration)
    except ChangeRefusedError as error:
        return Answer(refusal=str(error))
    answer = await _confirmed(operator, mission)
    change = mission.change
    if change is None or change == running.change:
        return answer
    return answer._replace(note=f"the change takes {change.duration:.1f} s")


async def tell_time(operator: Operator) -> None:
    """Wait until the swarm's time is known here, LOOK_TIME at most: without a gateway the own clock has to do."""
    deadline = clock.monotonic() + round(LOOK_TIME * BILLION)
    while not operator.knows_time() and clock.monotonic() < deadline:
        operator.poll()
        await asyncio.sleep(REPEAT)


async def _look_round(operator: Operator) -> Fleet:
    """Return what the swarm does, as soon as every pilot has reported it or LOOK_TIME is over."""
    deadline = clock.monotonic() + round(LOOK_TIME * BILLION)
    while True:
        fleet = operator.fleet()
        if len(fleet.fresh) == len(fleet.pilots) or clock.monotonic() >= deadline:
            return fleet
        await asyncio.sleep(POLL_PERIOD)
