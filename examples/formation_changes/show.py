"""Fly every formation of swarm.toml: python show.py [--real], from this folder."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from flockwire.scripting import open_swarm

HERE = Path(__file__).parent


async def show(virtual: bool, out: Path) -> bool:
    """Fly, print how well each formation is kept, and return whether the flight passed all checks."""
    async with open_swarm(HERE / "swarm.toml", virtual=virtual, out=out) as flight:
        await flight.start()
        for name in ("line", "rose", ""):
            await flight.formation(name)
            await flight.sleep(5.0)
            errors = [one.formation_error for one in flight.drones.values() if one.formation_error is not None]
            print(f"{name or 'circle'}: formation error {max(errors) * 1000:.0f} mm")
        await flight.land()
    if flight.summary is None:  # it flew nothing
        return False
    print("all well" if flight.summary.ok else "; ".join(flight.summary.failures()))
    return flight.summary.ok


if __name__ == "__main__":
    real = "--real" in sys.argv
    passed = asyncio.run(show(virtual=not real, out=Path("runs/real" if real else "runs/virtual")))
    raise SystemExit(not passed)
