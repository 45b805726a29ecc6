"""The page's server: files, one websocket for each page, orders from those that know the token.

The session to the swarm is opened once and kept, so a stop leaves at once.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import logging
from collections.abc import AsyncIterator, Coroutine
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web
from flockwire import clock
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Stop
from flockwire.wire.plan import Plan
from flockwire.wire.processes import CONSOLE

from flockwire_cli.console.picture import Scene, outline
from flockwire_cli.giving import ENDING, Answer, obey
from flockwire_cli.operator import Operator
from flockwire_cli.order import Order

PAGE = Path(__file__).with_name("page")
PERIOD = 0.1  # s between two pictures
ORDERS = ("start", "formation", "hold", "land", "stop")
LONGEST_ORDER = 4096  # bytes
MOST_PAGES = 32
LONGEST_SEND = 1.0  # s that a page may take to take a picture
HEARTBEAT = (
    20.0  # s: with less, a station that is busy for seconds would part with a page that is about to order a stop
)
POLICY = "default-src 'self'; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"


class Pages:
    """Serves the pages of one swarm."""

    def __init__(self, plan: Plan, operator: Operator, token: str) -> None:
        self._plan, self._operator, self._token = plan, operator, token
        self._scene = Scene(plan)
        self._sockets: dict[web.WebSocketResponse, asyncio.Transport] = {}
        self._sending: set[web.WebSocketResponse] = set()  # pages that have not taken the last picture yet
        self._tasks: set[asyncio.Task[None]] = set()
        self._starts: set[asyncio.Task[None]] = set()  # of these, the orders to start that are under way

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
        transport = request.transport
        assert transport is not None  # noqa: S101  (the connection was just answered)
        await socket.send_json({"outline": outline(self._plan), "orders": bool(given)})
        self._sockets[socket] = transport
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT and given:
                    self._order(socket, message.data)
        finally:
            self._sockets.pop(socket, None)
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
        if order.verb in ENDING:
            for start in self._starts:
                start.cancel()
        task = self._begin(self._answer(socket, order))
        if order.verb == "start":
            self._starts.add(task)
            task.add_done_callback(self._starts.discard)

    def _begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _answer(self, socket: web.WebSocketResponse, order: Order) -> None:
        try:
            answer = await obey(self._operator, self._plan, order)
        except asyncio.CancelledError:  # of a start: by an order that ends it
            answer = Answer(refusal="another order was given meanwhile")
        reason = answer.refusal or (f"not confirmed by {', '.join(answer.missing)}" if answer.missing else "")
        with contextlib.suppress(ConnectionError):
            await socket.send_json({"answer": {"order": order.verb, "failed": reason, "note": answer.note}})

    async def _broadcasting(self, _: web.Application) -> AsyncIterator[None]:
        task = asyncio.create_task(self._broadcast())
        yield
        task.cancel()

    async def _broadcast(self) -> None:
        """Send pictures; one that cannot be made is logged, once, and pages report that none comes."""
        due, failed = clock.monotonic(), ""
        while True:
            try:
                self._show()
                failed = ""
            except Exception as error:
                if repr(error) != failed:
                    failed = repr(error)
                    logging.getLogger(CONSOLE.kind).exception("cannot make a picture for the pages")
            due = max(due + round(PERIOD * BILLION), clock.monotonic())
            await asyncio.sleep((due - clock.monotonic()) / BILLION)

    def _show(self) -> None:
        """Send how everybody is to the pages that have taken the last picture."""
        now = self._operator.poll()
        ready = [socket for socket in self._sockets if socket not in self._sending]
        if ready:
            picture = json.dumps(self._scene.snapshot(self._operator.statuses, now), separators=(",", ":"))
            for socket in ready:
                self._sending.add(socket)
                self._begin(self._send(socket, self._sockets[socket], picture))

    async def _send(self, socket: web.WebSocketResponse, transport: asyncio.Transport, picture: str) -> None:
        """Send to a page; the connection of one that takes nothing for a while ends, without waiting for it."""
        try:
            await asyncio.wait_for(socket.send_str(picture), LONGEST_SEND)
        except (TimeoutError, ConnectionError):
            transport.abort()
        finally:
            self._sending.discard(socket)


@web.middleware
async def _guarded(request: web.Request, handler: Any) -> web.StreamResponse:  # noqa: ANN401  (aiohttp's)
    response: web.StreamResponse = await handler(request)
    if not response.prepared:
        response.headers["Content-Security-Policy"] = POLICY
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Cache-Control"] = "no-store"
    return response
