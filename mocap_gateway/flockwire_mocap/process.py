"""The process of the gateway."""

from __future__ import annotations

import random
from pathlib import Path

from flockwire.config import Swarm
from flockwire.runtime import run_core

from flockwire_mocap.core import GatewayCore


async def run(swarm: Swarm, keys: Path | None) -> None:
    """Serve poses until the process is told to end."""
    await run_core(GatewayCore(swarm, random.Random(swarm.gateway.seed)), swarm, "gateway", keys)  # noqa: S311 (noise)
