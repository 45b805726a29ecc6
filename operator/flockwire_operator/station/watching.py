"""Looks at a running swarm: the live table of `flockwire status`, and who flies with the keys that are replaced."""

from __future__ import annotations

import sys
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.time import nanoseconds
from flockwire_core.ground.fleet import IN_THE_AIR, STALE
from flockwire_core.runtime.session import RouterAbsentError, Session
from flockwire_core.security.files import CredentialsError
from flockwire_core.swarm.model import uav
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR
from rich.console import Console
from rich.live import Live

from flockwire_operator.station.answers import state, text
from flockwire_operator.station.connecting import connected
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.display import Rates, draw
from flockwire_operator.station.terminal.interrupts import interrupts
from flockwire_operator.station.terminal.keyboard import foreground

LOOK_TIME = 1.5  # s for all linked processes to report


async def watch(plan: Plan, keys: Path, once: bool, as_json: bool = False) -> tuple[str, ...]:
    """Show the table until it is interrupted, or print it once, also `as_json`; returns processes without a status.

    Printed once, it does not wait for a router. Raises CredentialsError.
    """
    refresh = 0.25  # s
    title = f"{plan.swarm.name}: {len(plan.pilots)} drones"
    console = Console()
    once = once or as_json or not foreground(sys.stdout)
    late = clock.monotonic() + nanoseconds(LOOK_TIME)
    with interrupts() as interrupted:
        session = await connected(
            plan, OPERATOR.kind, keys, interrupted, hopeless=lambda: once and clock.monotonic() > late
        )
        if session is None:
            return plan.started
        with session:
            operator, rates = Operator(session), Rates()
            await operator.watch(LOOK_TIME, lambda: len(operator.statuses) >= len(plan.started))
            if as_json:
                print(text(state(plan, operator.statuses, operator.poll())))
            elif once:
                console.print(draw(title, plan, plan.started, operator.statuses, rates, operator.poll()))
            if once:
                return tuple(identity for identity in plan.started if identity not in operator.statuses)
            with Live(console=console, refresh_per_second=1 / refresh) as live:

                def show(now: int) -> bool | None:
                    live.update(
                        draw(f"{title}   (Ctrl-C ends this view)", plan, plan.started, operator.statuses, rates, now)
                    )
                    return bool(interrupted.count) or None

                await operator.run(show, refresh)
    return ()


async def flying(plan: Plan, keys: Path) -> tuple[str, ...]:
    """Return the drones in the air, and linked processes of drones that do not report, as seen with `keys`."""
    try:
        session = Session(plan, OPERATOR.kind, keys)
    except (CredentialsError, RouterAbsentError):
        return ()  # no process accepts these keys, or none runs
    with session:
        operator = Operator(session)
        await operator.watch(LOOK_TIME)
        states = operator.core.fleet(operator.poll()).present().states
        airborne = [uav(drone) for drone, state in states.items() if state in IN_THE_AIR]
        now, linked = operator.poll(), set(session.linked())
        fresh = {identity for identity, status in operator.statuses.items() if now - status.stamp < STALE}
        return (*airborne, *(one for one, row in plan.rows.items() if row.flies and one in linked - fresh))
