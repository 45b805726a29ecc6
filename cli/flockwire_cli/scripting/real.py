"""A flight by script for real: all processes of this host, as `up` starts them, conducted by the script."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Self

from flockwire import clock
from flockwire.flight.director import POLL_PERIOD, STOP_FOR, Stage
from flockwire.wire.messages import Stop
from flockwire.wire.plan import Plan
from flockwire_recorder.report import write_report

from flockwire_cli.arguments import complete_keys
from flockwire_cli.interrupts import Interrupts
from flockwire_cli.operator import Operator
from flockwire_cli.processes import Children, PortInUseError, busy_endpoint
from flockwire_cli.restarting import Restarts
from flockwire_cli.scripting.flight import Flight, FlightError
from flockwire_cli.scripting.script_director import ScriptDirector
from flockwire_cli.up import UpOptions, alone, open_session, start_processes


class RealFlight(Flight):
    """A flight of `plan`, of the swarm file `file`; trace, report and logs go into the folder `out`.

    Signals are the script's own: asyncio.run's Ctrl-C cancels its task alone, and what conducts the flight lands it.
    """

    def __init__(self, plan: Plan, file: Path, out: Path) -> None:
        super().__init__(plan, ScriptDirector(plan, clock.now()))
        host = next(iter(plan.swarm.hosts))
        self._options = UpOptions(plan, file, host, 0.0, out, complete_keys(file, plan, None, host), headless=True)
        self._resources = AsyncExitStack()
        self._stopping: Stop | None = None
        self._stop_until = 0

    async def __aenter__(self) -> Self:
        """Start all processes; returns when they run."""
        flight, stack = self._options, self._resources
        stack.enter_context(alone(flight))
        if busy := busy_endpoint(flight.plan, flight.plan.processes_on(flight.host)):
            await stack.aclose()
            raise PortInUseError(busy)
        try:
            children = Children(flight.plan, flight.swarm_file, flight.out, flight.keys)
            stack.push_async_callback(children.end)
            here, never = flight.plan.processes_on(flight.host), Interrupts()
            session = await open_session(flight, children, here, never)
            if session is None:
                raise FlightError(children.died())
            self._operator = Operator(flight.plan, stack.enter_context(session))
            await start_processes(flight, children, here, self._operator, never)
            restarts = Restarts(flight.plan, children, lambda event: print(f"flockwire: {event}", file=sys.stderr))
            stack.push_async_callback(restarts.end)
            self._conducting = asyncio.create_task(self._conduct(restarts))
        except BaseException:
            await stack.aclose()
            raise
        return self

    async def __aexit__(self, _: object, failure: BaseException | None, __: object) -> None:
        """Land what flies, end all processes, write the report; raises FlightError where that cannot be written.

        Where the flight failed already, its failure is what the script gets.
        """
        try:
            if self._director.begun and self._director.stage is not Stage.OVER:
                self._operator.order(self._director.land(self._now()))
                await self._until(lambda: self._director.stage is Stage.OVER, "land", failing=True)
        finally:
            self._conducting.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._conducting
            await self._resources.aclose()
        out = self._options.out
        try:
            self.summary = write_report(out / "trace.mcap", out)
        except (OSError, ValueError) as error:
            if failure is None:
                raise FlightError(f"there is no report: {error}") from error

    async def sleep(self, seconds: float) -> None:
        """Wait."""
        await asyncio.sleep(seconds)

    async def _conduct(self, restarts: Restarts) -> None:
        """Give the orders that are due, as long as the flight lasts; a process that dies for good lands all."""
        operator, director = self._operator, self._director
        while True:
            now = operator.poll()
            died = restarts.step()
            if died and director.begun and not director.failure:
                operator.order(director.abort(died, now))
            operator.order(director.step(operator.statuses, operator.telemetry, now))
            if self._stopping is not None and now < self._stop_until:
                operator.order(self._stopping._replace(stamp=now))
            await asyncio.sleep(POLL_PERIOD)

    def _now(self) -> int:
        return clock.now()

    def _stop(self, reason: str) -> None:
        now = clock.now()
        self._stopping, self._stop_until = Stop(now, self.swarm.frame, reason), now + STOP_FOR
        self._operator.order(self._stopping)
        self._director.stop(now)
