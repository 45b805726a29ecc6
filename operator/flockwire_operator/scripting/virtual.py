"""A flight by script in virtual time: the world advances while the script waits."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Self

from flockwire_analysis.report import write_report
from flockwire_analysis.summary import summarise
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.wire.plan import Plan
from flockwire_lab.flight import TraceFile, TraceInMemory
from flockwire_lab.world import LINGER, World

from flockwire_operator.scripting.flight import Flight


class VirtualFlight(Flight):
    """A flight of `plan` by `seed`; with a folder `out` its trace and report go there."""

    def __init__(self, plan: Plan, file: Path, seed: int, out: Path | None) -> None:
        self._out = out
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            text = file.read_text(encoding="utf-8")
            self._trace: TraceFile | TraceInMemory = TraceFile(out / "trace.mcap", plan.swarm, text, seed)
        else:
            self._trace = TraceInMemory(plan.swarm, seed)
        self._world = World(plan.swarm, seed, 0.0, (), self._trace.take)
        self._world.conduct(None)
        super().__init__(self._world.plan)
        self._core = self._world.station().core

    async def __aenter__(self) -> Self:
        """Begin."""
        return self

    async def __aexit__(self, *_: object) -> None:
        """Land flying drones, end, and summarise."""
        await self._land_what_flies()
        await self.sleep(LINGER / SECOND)
        if isinstance(self._trace, TraceInMemory):
            self.summary = summarise(self._trace.trace())
        else:
            self._trace.close()
            assert self._out is not None  # noqa: S101  (there is a file)
            self.summary = write_report(self._out / "trace.mcap", self._out)

    async def sleep(self, seconds: float) -> None:
        """Advance virtual time by `seconds`."""
        self._world.advance(self._now() + nanoseconds(seconds))
        await asyncio.sleep(0)

    def _now(self) -> int:
        return self._world.scheduler.now

    def _publish(self) -> None:
        pass  # the operator's next step does
