"""The process of one follower's agent."""

from __future__ import annotations

from pathlib import Path

from flockwire import clock
from flockwire.config import Swarm
from flockwire.runtime import run_core
from flockwire.wiring import agent_identity

from flockwire_agent.core import AgentCore


async def run(swarm: Swarm, number: int, keys: Path | None) -> None:
    """Fly follower `number` until the process is told to end."""
    await run_core(AgentCore(swarm, number, clock.now()), swarm, agent_identity(number), keys)
