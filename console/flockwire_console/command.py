"""Serves the page, and Foxglove if requested, until it is interrupted."""

from __future__ import annotations

import asyncio
import secrets
from contextlib import ExitStack, closing
from pathlib import Path

from aiohttp import web
from flockwire import clock
from flockwire.wire.plan import Plan
from flockwire.wire.processes import CONSOLE
from flockwire_station.connecting import connected
from flockwire_station.operator import Operator
from flockwire_station.terminal.interrupts import interrupts

from flockwire_console.foxglove_server import FoxgloveServer
from flockwire_console.server import Pages

POLL = 0.1  # s


async def serve(plan: Plan, keys: Path, address: str, port: int, foxglove: int | None = None) -> bool:
    """Serve the pages of a swarm at `address`, and Foxglove at the port `foxglove` of it, None: not at all.

    Returns False if it was interrupted before the router answered. Raises OSError if the port cannot be opened,
    CredentialsError, FoxgloveError.
    """
    token = secrets.token_urlsafe(16)
    with interrupts() as interrupted, ExitStack() as stack:
        session = await connected(plan, CONSOLE.kind, keys, interrupted)
        if session is None:
            return False
        stack.enter_context(session)
        host = f"[{address}]" if ":" in address else address
        viewers = None
        if foxglove is not None:
            viewers = stack.enter_context(closing(FoxgloveServer(plan, CONSOLE.kind, session, address, foxglove)))
        pages = Pages(plan, Operator(plan, session, CONSOLE.kind), token, address)
        runner = web.AppRunner(pages.application(), access_log=None)
        await runner.setup()
        try:
            await web.TCPSite(runner, address, port).start()
            print(f"flockwire: http://{host}:{port}/#{token}", flush=True)
            if viewers is not None:
                print(f"flockwire: Foxglove and Lichtblick: ws://{host}:{viewers.port}", flush=True)
            while not interrupted.count:
                if viewers is not None:
                    viewers.forward(clock.now())
                await asyncio.sleep(POLL)
        finally:
            await runner.cleanup()
    return True
