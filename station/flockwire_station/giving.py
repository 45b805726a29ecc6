"""Gives one order to a running swarm, as a separate operator (ground/giving.py decides)."""

from __future__ import annotations

from pathlib import Path

from flockwire import clock
from flockwire.ground.order import ENDING, Answer, Order
from flockwire.runtime.session import UNKNOWN, RouterAbsentError, Session
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_station.operator import Operator
from flockwire_station.unlinked import why_unlinked


async def give(plan: Plan, keys: Path | None, order: Order) -> Answer:
    """Give one order that was requested at the start of this process; raises CredentialsError."""
    try:
        session = Session(plan, OPERATOR.kind, keys, verified=order.verb not in ENDING)
    except RouterAbsentError:
        why = await why_unlinked(plan, keys, OPERATOR.kind, plan.routers)
        return Answer(refusal=f"the router at {plan.endpoints[plan.routers[0]]} does not answer: {why}")
    with session:
        answer = await obey(Operator(plan, session), order, clock.uptime())
        return await _explained(answer, plan, keys, session) if answer.failure else answer


async def obey(operator: Operator, order: Order, ago: float = 0.0) -> Answer:
    """Give one order that was requested `ago` s ago; nothing else runs the operator."""
    answers: list[Answer] = []
    operator.ask(order, ago, answers.append)
    return await operator.run(lambda _: answers[0] if answers else None)


async def _explained(answer: Answer, plan: Plan, keys: Path | None, session: Session) -> Answer:
    """Return a bad answer with the causes of missing links."""
    linked, dialled = session.linked(), plan.dials[OPERATOR.kind]
    absent = [other for other in dialled if other not in linked]
    if not absent or UNKNOWN in linked:
        return answer
    why = await why_unlinked(plan, keys, OPERATOR.kind, absent)
    if len(absent) == len(dialled):
        return answer._replace(refusal=f"nothing was sent: no process is linked: {why}")
    return answer._replace(refusal=f"{answer.failure}; {why}")
