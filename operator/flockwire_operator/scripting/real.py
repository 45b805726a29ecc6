"""A real flight by script: all processes of this host, as `up` starts them, conducted by the script."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from contextlib import AsyncExitStack
from functools import partial
from pathlib import Path
from typing import Self

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


class RealFlight(Flight):
    """A flight of `plan`, of the swarm file `file`; trace, report and logs go into the folder `out`.

    The script handles signals: Ctrl-C in asyncio.run only cancels its task, and the flight lands.
    """

    def __init__(self, plan: Plan, file: Path, out: Path) -> None:
        super().__init__(plan)
        host = next(iter(plan.swarm.hosts))
        self._host = Host(plan, file, host, out, complete_keys(file, plan, None, host))
        self._resources = AsyncExitStack()

    async def __aenter__(self) -> Self:
        """Start all processes; returns when they run."""
        async with AsyncExitStack() as stack:
            stack.enter_context(unblocked())
            self._processes = await stack.enter_async_context(AsyncExitStack())
            try:
                children, self._operator = await self._processes.enter_async_context(running(self._host, Interrupts()))
            except UnansweredError as error:
                raise FlightError(str(error)) from None
            self._core = self._operator.core
            restarts = Restarts(self._host.plan, children, _note)
            self._conducting = asyncio.create_task(self._operator.run(partial(self._look_after, restarts)))
            self._processes.push_async_callback(self._end_conducting)
            self._resources = stack.pop_all()
        return self

    async def __aexit__(self, _: object, failure: BaseException | None, __: object) -> None:
        """Land flying drones, end all processes, write the report; raises FlightError if it cannot be written.

        If the flight has already failed, the script gets that failure.
        """
        async with self._resources:
            try:
                await self._land_what_flies()
            finally:
                await self._processes.aclose()
            out = self._host.out
            try:
                self.summary = write_report(out / "trace.mcap", out)
            except (OSError, ValueError) as error:
                if failure is None:
                    raise FlightError(f"there is no report: {error}") from error

    async def _end_conducting(self) -> None:
        self._conducting.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._conducting

    async def sleep(self, seconds: float) -> None:
        """Wait."""
        await asyncio.sleep(seconds)

    def _look_after(self, restarts: Restarts, now: int) -> bool | None:
        """Restart dead processes; if one cannot be restarted, all drones land."""
        if died := restarts.step(now):
            self._core.abort(died, now)
        return None

    def _now(self) -> int:
        return clock.now()

    def _publish(self) -> None:
        self._operator.publish()
