"""A flight by script in virtual time: the world advances while the script waits."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from flockwire_analysis.report import write_report
from flockwire_analysis.summary import summarise
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.wire.plan import Plan
from flockwire_lab.flight import TraceFile, TraceInMemory
from flockwire_lab.world import LINGER, World

from flockwire_operator.scripting.flight import Flight


@asynccontextmanager
async def virtual_flight(plan: Plan, file: Path, seed: int, out: Path | None) -> AsyncIterator[Flight]:
    """Fly `plan` by `seed`; with a folder `out` its trace and report go there."""
    trace: TraceFile | TraceInMemory = TraceInMemory(plan.swarm, seed)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        trace = TraceFile(out / "trace.mcap", plan.swarm, file.read_text(encoding="utf-8"), seed)
    world = World(plan.swarm, seed, 0.0, (), trace.take)
    world.conduct(None)

    async def sleep(seconds: float) -> None:
        world.advance(world.scheduler.now + nanoseconds(seconds))
        await asyncio.sleep(0)

    flight = Flight(world.plan, world.station().core, lambda: world.scheduler.now, sleep)
    try:
        yield flight
    finally:
        await flight._land_what_flies()
        await sleep(LINGER / SECOND)
        if isinstance(trace, TraceInMemory):
            flight.summary = summarise(trace.trace())
        elif out is not None:
            trace.close()
            flight.summary = write_report(out / "trace.mcap", out)
