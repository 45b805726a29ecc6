"""Receives from a tracker for some seconds, without the swarm: for `flockwire tracker` and `align`."""

from __future__ import annotations

import asyncio
from random import Random

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import GATEWAY

from flockwire_mocap.core import make_core
from flockwire_mocap.process import feed
from flockwire_mocap.survey.inspection import Inspection
from flockwire_mocap.tracking import SourceState


async def listen(plan: Plan, seconds: float) -> tuple[Inspection, SourceState]:
    """Return the frames of `seconds`, and the state of the connection; raises OSError if the source cannot be opened.

    Raises ValueError for a source without its own connection.
    """
    core = make_core(Start(plan, GATEWAY.kind, clock.now(), Random(0)))  # noqa: S311
    source, inspection = core.source, Inspection(plan.swarm)
    begin = clock.monotonic() + round(1.2 * SECOND)  # s before the first frame counts: connections and names come first

    def drained() -> None:
        now = clock.now()
        for frame in source.take(now):
            if clock.monotonic() > begin:
                inspection.take(frame, now)

    connection = feed(core, drained)
    if connection is None:
        raise ValueError(f"gateway.source = {plan.swarm.gateway.source!r}: there is no tracker to listen to")
    async with connection:
        while clock.monotonic() < begin + round(seconds * SECOND):
            await asyncio.sleep(core.period)
            if not source.triggers:  # no message completes its frames: they are due by time
                drained()
        return inspection, source.state(clock.now())
