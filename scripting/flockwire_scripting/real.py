"""A flight by script for real: all processes of this host, as `up` starts them, conducted by the script."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from contextlib import AsyncExitStack
from functools import partial
from pathlib import Path
from typing import Self

from flockwire import clock
from flockwire.domain.vector import Vector
from flockwire.wire.messages import Mission
from flockwire.wire.plan import Plan
from flockwire_analysis.report import write_report
from flockwire_station.folders import complete_keys
from flockwire_station.operator import Operator
from flockwire_station.planning import plan_off_loop
from flockwire_station.processes import Children, PortInUseError, Restarts, busy_endpoint
from flockwire_station.terminal.interrupts import Interrupts
from flockwire_station.up import UpOptions, alone, open_session, start_processes

from flockwire_scripting.flight import Flight, FlightError


class RealFlight(Flight):
    """A flight of `plan`, of the swarm file `file`; trace, report and logs go into the folder `out`.

    Signals are the script's own: asyncio.run's Ctrl-C cancels its task alone, and what conducts the flight lands it.
    """

    def __init__(self, plan: Plan, file: Path, out: Path) -> None:
        super().__init__(plan)
        host = next(iter(plan.swarm.hosts))
        self._options = UpOptions(plan, file, host, 0.0, out, complete_keys(file, plan, None, host), headless=True)
        self._resources = AsyncExitStack()

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
            self._core = self._operator.core
            await start_processes(flight, children, here, self._operator, never)
            restarts = Restarts(flight.plan, children, lambda event: print(f"flockwire: {event}", file=sys.stderr))
            stack.push_async_callback(restarts.end)
            self._conducting = asyncio.create_task(self._operator.run(partial(self._look_after, restarts)))
        except BaseException:
            await stack.aclose()
            raise
        return self

    async def __aexit__(self, _: object, failure: BaseException | None, __: object) -> None:
        """Land what flies, end all processes, write the report; raises FlightError where that cannot be written.

        Where the flight failed already, its failure is what the script gets.
        """
        try:
            await self._land_what_flies()
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

    def _look_after(self, restarts: Restarts, now: int) -> bool | None:
        """Start again what died; a process that died for good lands all."""
        if died := restarts.step():
            self._core.abort(died, now)
        return None

    async def _planned(self, running: Mission, name: str, leader: Vector | None, duration: float | None) -> Mission:
        return await plan_off_loop(self.swarm, running, name, leader, duration)

    def _now(self) -> int:
        return clock.now()

    def _publish(self) -> None:
        self._operator.publish()
