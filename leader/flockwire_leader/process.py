"""The process of the leader."""

from __future__ import annotations

from pathlib import Path

from flockwire import clock
from flockwire.config import Swarm
from flockwire.runtime import run_core

from flockwire_leader.core import FlyingLeader, VirtualLeader


async def run(swarm: Swarm, keys: Path | None) -> None:
    """Lead until the process is told to end."""
    core = VirtualLeader if swarm.leader.kind == "virtual" else FlyingLeader
    await run_core(core(swarm, clock.now()), swarm, "leader", keys)
