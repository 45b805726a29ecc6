"""The process of the gateway."""

from __future__ import annotations

import random

from flockwire.config import Swarm
from flockwire.faults import Fault
from flockwire.runtime import run_core

from flockwire_mocap.core import GatewayCore


async def run(swarm: Swarm, faults: tuple[Fault, ...] = ()) -> None:
    """Serve poses until the process is told to end."""
    await run_core(GatewayCore(swarm, random.Random(swarm.gateway.seed), faults), swarm, "gateway")  # noqa: S311 (noise)
