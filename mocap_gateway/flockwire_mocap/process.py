"""The process of the gateway."""

from __future__ import annotations

import random
from pathlib import Path

from flockwire.config import Swarm
from flockwire.faults import Fault
from flockwire.runtime import run_core

from flockwire_mocap.core import GatewayCore


async def run(swarm: Swarm, keys: Path | None, faults: tuple[Fault, ...] = ()) -> None:
    """Serve poses until the process is told to end."""
    core = GatewayCore(swarm, random.Random(swarm.gateway.seed), faults)  # noqa: S311 (noise)
    await run_core(core, swarm, "gateway", keys)
