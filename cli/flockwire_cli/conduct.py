"""`flockwire conduct`: a flight of processes that something else started: containers, systemd, terminals."""

from __future__ import annotations

import asyncio
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import POLL_PERIOD, Director, Stage
from flockwire.flight.preflight import Preflight
from flockwire.nanoseconds import BILLION
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_cli.connecting import UNANSWERED, connected
from flockwire_cli.display import Display
from flockwire_cli.giving import tell_time
from flockwire_cli.interrupts import Interrupts, interrupts
from flockwire_cli.key_orders import KeyOrders
from flockwire_cli.keyboard import Keyboard, keys_pressed
from flockwire_cli.operator import Operator

COMES_BACK = 10 * BILLION  # ns in which a supervisor has started a process again that ended in flight
LEFT = "left before the drones were known to be down; `flockwire land` lands them"


async def conduct(plan: Plan, keys: Path, duration: float, out: Path | None, headless: bool) -> str:
    """Fly from take-off to landing; returns why the flight failed, empty when it did not.

    The first interrupt lands. Raises CredentialsError.
    """
    with interrupts() as interrupted:
        session = await connected(plan, OPERATOR.kind, keys, interrupted)
        if session is None:
            return UNANSWERED
        with session:
            operator, ready = Operator(plan, session), Preflight.of(plan.swarm)
            await tell_time(operator)  # so that orders from before this flight are known for such
            director = Director(plan.pilots, plan.swarm.frame, duration, clock.now(), grace=COMES_BACK, preflight=ready)
            display = Display(plan, plan.started, director, headless)
            if out is not None:
                display.begin(out)
            orders = KeyOrders(plan, operator, director, display.note)
            with display.shown(), keys_pressed(Keyboard(orders.give)):
                return await _fly(operator, director, display, orders, interrupted)


async def _fly(
    operator: Operator, director: Director, display: Display, orders: KeyOrders, interrupted: Interrupts
) -> str:
    heeded = 0
    while director.stage is not Stage.OVER:
        now = operator.poll()
        if interrupted.count > 1:
            return director.failure or LEFT
        if interrupted.count > heeded:
            heeded = interrupted.count
            operator.order(director.land(now))
        operator.order(director.step(operator.statuses, operator.telemetry, now))
        orders.repeat(now)
        display.update(operator, now)
        await asyncio.sleep(POLL_PERIOD)
    return director.failure
