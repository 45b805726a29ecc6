"""The console's pages of a simulated swarm, served in this process."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from aiohttp import web
from flockwire_operator.console.server import Pages
from flockwire_operator.station.operator import Operator
from simulated_pilots import SimulatedSwarm

TOKEN = "token"


@asynccontextmanager
async def serving(swarm: SimulatedSwarm, address: str = "localhost") -> AsyncIterator[tuple[Pages, int]]:
    """Serve the pages of a swarm; yields them and the port."""
    pages = Pages(swarm.plan, Operator(swarm), TOKEN, address)
    runner = web.AppRunner(pages.application(), access_log=None)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    try:
        yield pages, runner.addresses[0][1]
    finally:
        await runner.cleanup()
