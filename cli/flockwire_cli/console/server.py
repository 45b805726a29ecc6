"""The page's server: files, one websocket for each page, orders from those that know the token.

The session to the swarm is opened once and kept, so a stop leaves at once.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web
from flockwire import clock
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Stop
from flockwire.wire.plan import Plan

from flockwire_cli.console.picture import Scene, outline
from flockwire_cli.giving import obey
from flockwire_cli.operator import Operator
from flockwire_cli.order import Order

PAGE = Path(__file__).with_name("page")
PERIOD = 0.1  # s between two pictures
ORDERS = ("start", "formation", "hold", "land", "stop")
LONGEST_ORDER = 4096  # bytes
MOST_PAGES = 32
HEARTBEAT = (
    20.0  # s: with less, a station that is busy for seconds would part with a page that is about to order a stop
)
POLICY = "default-src 'self'; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"


class Pages:
    """Serves the pages of one swarm."""

    def __init__(self, plan: Plan, operator: Operator, token: str) -> None:
        self._plan, self._operator, self._token = plan, operator, token
        self._scene = Scene(plan)
        self._sockets: set[web.WebSocketResponse] = set()
        self._tasks: set[asyncio.Task[None]] = set()

    def application(self) -> web.Application:
        """Return what a web server runs."""
        app = web.Application(middlewares=[_guarded])
        app.router.add_get("/", self._file)
        app.router.add_get("/{name:app\\.js|style\\.css}", self._file)
        app.router.add_get("/live", self._live)
        app.cleanup_ctx.append(self._broadcasting)
        return app

    async def _file(self, request: web.Request) -> web.StreamResponse:
        return web.FileResponse(PAGE / request.match_info.get("name", "index.html"))

    async def _live(self, request: web.Request) -> web.StreamResponse:
        """Show the flight to a page; one with the token may give orders, a wrong one is refused."""
        given = request.query.get("token", "")
        if given and not hmac.compare_digest(given.encode(), self._token.encode()):
            raise web.HTTPForbidden(text="wrong token")
        origin = request.headers.get("Origin")
        if origin is not None and origin.partition("://")[2] != request.host:
            raise web.HTTPForbidden(text="another site's page")
        if len(self._sockets) >= MOST_PAGES:
            raise web.HTTPServiceUnavailable(text=f"{MOST_PAGES} pages are open already")
        socket = web.WebSocketResponse(max_msg_size=LONGEST_ORDER, heartbeat=HEARTBEAT)
        await socket.prepare(request)
        await socket.send_json({"outline": outline(self._plan), "orders": bool(given)})
        self._sockets.add(socket)
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT and given:
                    self._order(socket, message.data)
        finally:
            self._sockets.discard(socket)
        return socket

    def _order(self, socket: web.WebSocketResponse, text: str) -> None:
        """Give the order of a page; a stop leaves before anything else is looked at."""
        try:
            asked: dict[str, Any] = json.loads(text)
            order = Order(asked["order"], str(asked.get("formation", "")))
        except (ValueError, TypeError, KeyError):
            return
        if order.verb not in ORDERS or (order.formation and order.formation not in self._plan.swarm.formations):
            return
        if order.verb == "stop":
            self._operator.order(Stop(clock.now(), self._plan.swarm.frame, "the order of a page"))
        task = asyncio.create_task(self._answer(socket, order))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _answer(self, socket: web.WebSocketResponse, order: Order) -> None:
        answer = await obey(self._operator, self._plan, order)
        reason = answer.refusal or (f"not confirmed by {', '.join(answer.missing)}" if answer.missing else "")
        with contextlib.suppress(ConnectionError):
            await socket.send_json({"answer": {"order": order.verb, "failed": reason, "note": answer.note}})

    async def _broadcasting(self, _: web.Application) -> AsyncIterator[None]:
        task = asyncio.create_task(self._broadcast())
        yield
        task.cancel()

    async def _broadcast(self) -> None:
        due = clock.monotonic()
        while True:
            now = self._operator.poll()
            if self._sockets:
                picture = json.dumps(self._scene.snapshot(self._operator.statuses, now), separators=(",", ":"))
                await asyncio.gather(*(_sent(socket, picture) for socket in tuple(self._sockets)))
            due = max(due + round(PERIOD * BILLION), clock.monotonic())
            await asyncio.sleep((due - clock.monotonic()) / BILLION)


async def _sent(socket: web.WebSocketResponse, text: str) -> None:
    """Send to a page; one that takes nothing for a second is closed rather than waited for."""
    try:
        await asyncio.wait_for(socket.send_str(text), 1.0)
    except (TimeoutError, ConnectionError):
        await socket.close()


@web.middleware
async def _guarded(request: web.Request, handler: Any) -> web.StreamResponse:  # noqa: ANN401  (aiohttp's)
    response: web.StreamResponse = await handler(request)
    if not response.prepared:
        response.headers["Content-Security-Policy"] = POLICY
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Cache-Control"] = "no-store"
    return response
