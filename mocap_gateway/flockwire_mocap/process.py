"""The gateway's process: the shell around its core, and the connection of its source, if it has one."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import cast

from flockwire_core.objects import load_object
from flockwire_core.process.cores import Core
from flockwire_core.runtime.job import Job
from flockwire_core.runtime.shell import run_core

from flockwire_mocap.core import SOURCES, GatewayCore


def feed(core: Core, step: Callable[[], None]) -> AbstractAsyncContextManager[None] | None:
    """Return the connection of the core's source; it calls `step` when a frame is complete."""
    gateway = cast("GatewayCore", core)
    source, connected = gateway.source, SOURCES[gateway.kind].connected

    def drained() -> None:
        if source.complete():
            step()

    return cast("AbstractAsyncContextManager[None]", load_object(connected)(source, drained)) if connected else None


async def run(job: Job) -> None:
    """Run the gateway until it must end; raises OSError if its source cannot be opened."""
    await run_core(job, lambda core, shell: feed(core, shell.step))
