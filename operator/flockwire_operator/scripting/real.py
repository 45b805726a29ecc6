"""A real flight by script: all processes of this host, as `up` starts them, conducted by the script."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from pathlib import Path

from flockwire_analysis.report import write_report
from flockwire_core import clock
from flockwire_core.runtime.standard_streams import later, unblocked
from flockwire_core.wire.plan import Plan

from flockwire_operator.scripting.flight import Flight, FlightError
from flockwire_operator.station.folders import complete_keys
from flockwire_operator.station.host import Host
from flockwire_operator.station.processes import UnansweredError, running
from flockwire_operator.station.restarts import Restarts
from flockwire_operator.station.terminal.interrupts import Interrupts


def _note(event: str) -> None:
    later(partial(print, f"flockwire: {event}", file=sys.stderr))


@asynccontextmanager
async def real_flight(plan: Plan, file: Path, out: Path) -> AsyncIterator[Flight]:
    """Run all processes of the swarm `file` for a flight; trace, report and logs go into the folder `out`.

    The script handles signals: Ctrl-C in asyncio.run only cancels its task, and the flight lands.
    """
    name = next(iter(plan.swarm.hosts))
    host = Host(plan, file, name, out, complete_keys(file, plan, None, name))
    with unblocked():
        processes = AsyncExitStack()
        try:
            children, operator = await processes.enter_async_context(running(host, Interrupts()))
        except UnansweredError as error:
            raise FlightError(str(error)) from None
        flight = Flight(plan, operator.core, clock.now, asyncio.sleep, operator.publish)
        ended, restarts = asyncio.Event(), Restarts(plan, children, _note)

        def look_after(now: int) -> bool | None:
            """Restart dead processes; if one cannot be restarted, all drones land."""
            if died := restarts.step(now):
                operator.core.abort(died, now)
            return ended.is_set() or None

        async with AsyncExitStack() as stack:  # its end is in the opposite order
            stack.push(partial(_report, flight, out))
            await stack.enter_async_context(processes)
            conducting = asyncio.create_task(operator.run(look_after))
            stack.push_async_callback(lambda: conducting)
            stack.callback(ended.set)
            stack.push_async_callback(flight._land_what_flies)
            yield flight


def _report(flight: Flight, out: Path, _: object, failure: BaseException | None, __: object) -> None:
    """Write the report; raises FlightError if it cannot, but if there is a `failure`, the script gets that."""
    try:
        flight.summary = write_report(out / "trace.mcap", out)
    except (OSError, ValueError) as error:
        if failure is None:
            raise FlightError(f"there is no report: {error}") from error
