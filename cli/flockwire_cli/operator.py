"""The operator: receives how everybody is, and gives orders."""

from __future__ import annotations

import asyncio
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import LEAD_TIME, POLL_PERIOD, Director, Stage
from flockwire.flight.phases import Phase
from flockwire.runtime.session import RouterAbsentError, Session
from flockwire.wire.keys import MISSION, STOP
from flockwire.wire.messages import Message, Mission, Stop
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR
from flockwire.wire.status import Status

LINK_TIME = 5.0  # s to wait for the swarm to be there
STOPS = 3  # times that an emergency stop is said


class Operator:
    """Publishes and subscribes as the operator on `session`."""

    def __init__(self, plan: Plan, session: Session) -> None:
        self.statuses: dict[str, Status] = {}
        self._session = session
        self._sources = [self._session.newest(key) for key in plan.subscribes[OPERATOR.kind] if key.kind == "status"]

    def poll(self) -> int:
        """Take in the newest statuses; returns the present time, Unix ns."""
        now = clock.now()
        for source in self._sources:
            received = source.take(now)
            if received is None or not isinstance(received.message, Status):
                continue
            if received.message.identity == source.inbox.key.owner:  # nobody speaks for another
                self.statuses[received.message.identity] = received.message
        return now

    def order(self, message: Message | None) -> None:
        """Publish a mission or a stop; None is no order."""
        if message is not None:
            self._session.publish([(STOP if isinstance(message, Stop) else MISSION, message)])


async def give(plan: Plan, keys: Path | None, verb: str, formation: str = "") -> str:
    """Give one order to a swarm that runs; returns why that failed, empty when it did not. Raises CredentialsError."""
    try:
        session = Session(plan, OPERATOR.kind, keys)
    except RouterAbsentError:
        return f"the router at {plan.endpoints[plan.routers[0]]} does not answer"
    with session:
        operator, swarm = Operator(plan, session), plan.swarm
        if not await _meet(operator, plan.pilots):
            there = ", ".join(sorted(operator.statuses)) or "nobody"
            return f"not all of the swarm answer within {LINK_TIME:.0f} s; there: {there}"
        now = clock.now()
        if verb == "stop":
            for _ in range(STOPS):
                operator.order(Stop(clock.now(), swarm.frame, "the operator says so"))
                await asyncio.sleep(POLL_PERIOD)
        elif verb == "start":
            return await _start(operator, plan, formation)
        else:
            operator.order(Mission(now, swarm.frame, verb))
        await asyncio.sleep(2 * POLL_PERIOD)  # what is sent must leave before the session closes
    return ""


async def _meet(operator: Operator, expected: tuple[str, ...]) -> bool:
    for _ in range(round(LINK_TIME / POLL_PERIOD)):
        operator.poll()
        if all(identity in operator.statuses for identity in expected):
            return True
        await asyncio.sleep(POLL_PERIOD)
    return False


async def _start(operator: Operator, plan: Plan, formation: str) -> str:
    """Take off where need be, then start the formation."""
    now = clock.now()
    in_flight = {operator.statuses[pilot].report.phase for pilot in plan.pilots} <= {Phase.HOLD, Phase.FORMATION}
    if not in_flight:
        director = Director(plan.pilots, plan.swarm.frame, 0.0, now)
        while director.stage not in (Stage.FLYING, Stage.OVER):
            operator.order(director.step(operator.statuses, operator.poll()))
            await asyncio.sleep(POLL_PERIOD)
        if director.failure:
            return director.failure
    now = clock.now()
    operator.order(Mission(now, plan.swarm.frame, "start", now + LEAD_TIME, formation))
    await asyncio.sleep(2 * POLL_PERIOD)
    return ""
