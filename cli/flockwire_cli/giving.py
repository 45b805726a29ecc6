"""Giving one order to a swarm that runs: at once to those linked, again until confirmed; then who confirmed it.

No order waits for anybody. A process that is dead, frozen or cut off is named in the answer.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from flockwire import clock
from flockwire.flight.director import LEAD_TIME, POLL_PERIOD, Director, Stage
from flockwire.flight.fleet import Fleet
from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.runtime.session import RouterAbsentError, Session
from flockwire.swarm.model import uav
from flockwire.wire.messages import FlightState, Mission, Stop
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_cli.operator import Operator

DELIBERATE = ("start", "formation")  # orders that may wait until the operator's own certificate is verified
REPEAT = 0.02  # s between two repetitions of an order
ANSWER_TIME = 3.0  # s in which everybody should have confirmed an order
LOOK_TIME = 1.5  # s to look round before an order that depends on what the swarm does


class Answer(NamedTuple):
    """Who confirmed an order, who did not, and why nothing was ordered (empty: it was)."""

    confirmed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    refusal: str = ""


async def give(plan: Plan, keys: Path | None, verb: str, formation: str = "") -> Answer:
    """Give one order: "stop", "hold", "land", "start" or "formation"; raises CredentialsError."""
    try:
        session = Session(plan, OPERATOR.kind, keys, verified=verb in DELIBERATE)
    except RouterAbsentError:
        return Answer(refusal=f"the router at {plan.endpoints[plan.routers[0]]} does not answer")
    with session:
        operator = Operator(plan, session)
        if verb == "stop":
            return await _stop(operator, plan)
        if verb == "start":
            return await _start(operator, plan, formation)
        if verb == "formation":
            return await _change(operator, plan, formation)
        return await _confirmed(operator, Mission(clock.now(), plan.swarm.frame, verb))


async def _stop(operator: Operator, plan: Plan) -> Answer:
    """Stop the motors of every drone; a driver confirms by telemetry."""

    def missing(fleet: Fleet) -> tuple[str, ...]:
        return tuple(uav(i) for i in plan.pilots if fleet.states.get(i) is not FlightState.STOPPED)

    def send() -> None:
        operator.order(Stop(clock.now(), plan.swarm.frame, "the operator's order"))

    left = await _repeated(operator, send, missing)
    return Answer(tuple(name for name in map(uav, plan.pilots) if name not in left), left)


async def _confirmed(operator: Operator, order: Mission) -> Answer:
    """Publish `order` until every pilot confirms that it obeys it, or ANSWER_TIME is over."""
    left = await _repeated(operator, lambda: operator.order(order), lambda fleet: fleet.unconfirmed(order))
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


async def _start(operator: Operator, plan: Plan, formation: str) -> Answer:
    """Take off where need be, then start the formation; who is on the ground joins a formation that flies."""
    fleet = await _look_round(operator)
    running = fleet.mission()
    if fleet.all_in(Phase.FORMATION) and running is not None:
        if running.formation == formation:
            return Answer(tuple(plan.pilots.values()))
        return await _change(operator, plan, formation)
    director = Director(plan.pilots, plan.swarm.frame, 0.0, clock.now(), formation)
    while director.stage not in (Stage.FLYING, Stage.OVER) and not director.failure:
        operator.order(director.step(operator.statuses, operator.telemetry, operator.poll()))
        await asyncio.sleep(POLL_PERIOD)
    if director.failure:
        return Answer(refusal=director.failure)
    return await _started(operator, director)


async def _started(operator: Operator, director: Director) -> Answer:
    """Repeat the order to start until all have confirmed it."""
    deadline = clock.monotonic() + round(ANSWER_TIME * BILLION) + LEAD_TIME
    while clock.monotonic() < deadline:
        order = director.step(operator.statuses, operator.telemetry, operator.poll())
        operator.order(order)
        fleet = operator.fleet()
        if fleet.all_in(Phase.FORMATION):
            return Answer(tuple(fleet.pilots.values()))
        await asyncio.sleep(POLL_PERIOD)
    late = tuple(pilot for drone, pilot in fleet.pilots.items() if fleet.phase(drone) != Phase.FORMATION)
    return Answer(tuple(pilot for pilot in fleet.pilots.values() if pilot not in late), late)


async def _change(operator: Operator, plan: Plan, formation: str) -> Answer:
    """Change to another formation, whose time goes on; refused where no formation is flown."""
    fleet = await _look_round(operator)
    running = fleet.mission()
    if running is None or running.verb != "start" or not any(fleet.phase(i) == Phase.FORMATION for i in plan.pilots):
        return Answer(refusal="nobody flies a formation; `flockwire start --formation NAME` takes off")
    return await _confirmed(operator, running._replace(stamp=clock.now(), formation=formation))


async def _look_round(operator: Operator) -> Fleet:
    """Return what the swarm does, as soon as every pilot has reported it or LOOK_TIME is over."""
    deadline = clock.monotonic() + round(LOOK_TIME * BILLION)
    while True:
        fleet = operator.fleet()
        if len(fleet.fresh) == len(fleet.pilots) or clock.monotonic() >= deadline:
            return fleet
        await asyncio.sleep(POLL_PERIOD)
