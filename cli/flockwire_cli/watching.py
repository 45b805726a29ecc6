"""`flockwire status`: the live table of processes that were started by hand."""

from __future__ import annotations

import asyncio
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import POLL_PERIOD
from flockwire.nanoseconds import BILLION
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR
from rich.console import Console
from rich.live import Live

from flockwire_cli.connecting import connected
from flockwire_cli.interrupts import interrupts
from flockwire_cli.operator import Operator
from flockwire_cli.table import Rates, draw

LOOK_TIME = 1.5  # s in which whoever is linked has reported
REFRESH = 0.25  # s


async def watch(plan: Plan, keys: Path, once: bool) -> tuple[str, ...]:
    """Show the table until it is interrupted, or print it once; returns who had no status. Raises CredentialsError.

    Once, it does not wait for a router that does not answer.
    """
    console = Console()
    once = once or not console.is_terminal
    late = clock.monotonic() + round(LOOK_TIME * BILLION)
    with interrupts() as interrupted:
        session = await connected(
            plan, OPERATOR.kind, keys, interrupted, hopeless=lambda: once and clock.monotonic() > late
        )
        if session is None:
            return plan.started
        with session:
            operator, rates = Operator(plan, session), Rates()
            await _settle(operator, plan)
            if once:
                console.print(draw(_title(plan), plan, plan.started, operator.statuses, rates, operator.poll()))
                return tuple(identity for identity in plan.started if identity not in operator.statuses)
            with Live(console=console, refresh_per_second=1 / REFRESH) as live:
                while not interrupted.count:
                    now = operator.poll()
                    live.update(
                        draw(
                            f"{_title(plan)}   (Ctrl-C ends this view)",
                            plan,
                            plan.started,
                            operator.statuses,
                            rates,
                            now,
                        )
                    )
                    await asyncio.sleep(REFRESH)
    return ()


async def _settle(operator: Operator, plan: Plan) -> None:
    """Wait until everybody has reported, or LOOK_TIME is over."""
    deadline = clock.monotonic() + round(LOOK_TIME * BILLION)
    while len(operator.statuses) < len(plan.started) and clock.monotonic() < deadline:
        operator.poll()
        await asyncio.sleep(POLL_PERIOD)


def _title(plan: Plan) -> str:
    return f"{plan.swarm.name}: {len(plan.pilots)} drones"
