"""The process of the kinematics: drivers and airframes of all simulated drones."""

from __future__ import annotations

from pathlib import Path

from flockwire import clock
from flockwire.config import Swarm
from flockwire.faults import Fault
from flockwire.runtime import run_core

from flockwire_tello.core import KinematicsCore


async def run(swarm: Swarm, keys: Path | None, faults: tuple[Fault, ...] = ()) -> None:
    """Simulate until the process is told to end."""
    await run_core(KinematicsCore(swarm, clock.now(), faults), swarm, "kinematics", keys)
