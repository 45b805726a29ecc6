"""The page's server: files, one websocket for each page, orders from pages with the token.

The session to the swarm stays open, so a stop is sent at once.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import ipaddress
import json
import logging
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web
from flockwire_analysis.view import SCRIPTS, filled, joined, outline
from flockwire_core import clock
from flockwire_core.domain.order import Answer, Order
from flockwire_core.domain.time import nanoseconds
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import CONSOLE

from flockwire_operator.console.picture import snapshot
from flockwire_operator.places import Places
from flockwire_operator.station.operator import Operator

PAGE = Path(__file__).with_name("page")
PERIOD = 0.1  # s between two pictures
ORDERS = ("start", "formation", "hold", "land", "stop")
MOST_PAGES = 32  # with the token, and as many without: those keep no operator out
LONGEST_SEND = 1.0  # s for a page to accept a picture
OTHER_LINK = "this link has the token of another console; open the link that the console printed at its last start"
POLICY = (
    "default-src 'self'; connect-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'"
)
_HOST = re.compile(r"(?:\[(?P<v6>[^\]]*)\]|(?P<name>[^:]*))(?::\d+)?")


class Pages:
    """Serves the pages of one swarm, requested by its `address` or by an IP address."""

    def __init__(self, plan: Plan, operator: Operator, token: str, address: str = "localhost") -> None:
        self._plan, self._operator, self._token = plan, operator, token
        self._names = frozenset({"localhost", address.lower()})
        self._places = Places(plan.swarm)
        self._files = _files()
        self._pages: list[bool] = []  # for each open page: whether it has the token
        self._picture, self._drawn = "", asyncio.Event()  # the newest picture, and the event of the next one
        self._tasks: set[asyncio.Task[None]] = set()

    def application(self) -> web.Application:
        """Return the ASGI application."""
        app = web.Application(middlewares=[self._guarded])
        for path in self._files:
            app.router.add_get(path, self._file)
        app.router.add_get("/live", self._live)
        app.cleanup_ctx.append(self._operating)
        return app

    @web.middleware
    async def _guarded(self, request: web.Request, handler: Any) -> web.StreamResponse:  # noqa: ANN401  (aiohttp's)
        """Answer 403 unless the host is an IP address, localhost or the own address: DNS may lead others here."""
        if not is_own(request.headers.get("Host", ""), self._names):
            raise web.HTTPForbidden(text="the console does not accept this host name; open it by its IP address")
        response: web.StreamResponse = await handler(request)
        if not response.prepared:
            response.headers["Content-Security-Policy"] = POLICY
            response.headers["X-Content-Type-Options"] = "nosniff"
            response.headers["Referrer-Policy"] = "no-referrer"
            response.headers["Cache-Control"] = "no-store"
        return response

    async def _file(self, request: web.Request) -> web.StreamResponse:
        text, content_type = self._files[request.path]
        return web.Response(text=text, content_type=content_type, charset="utf-8")

    async def _live(self, request: web.Request) -> web.StreamResponse:
        """Show the flight to a page; a page with the token may give orders, a wrong token is refused."""
        longest_order = 4096  # bytes
        heartbeat = 20.0  # s: with less, a busy station could disconnect a page that is about to order a stop
        given = self._admitted(request)
        socket = web.WebSocketResponse(max_msg_size=longest_order, heartbeat=heartbeat)
        await socket.prepare(request)
        await socket.send_json({"outline": outline(self._plan), "orders": given})
        self._pages.append(given)
        showing = asyncio.create_task(self._send(socket, request))
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT and given:
                    self._order(socket, message.data)
        finally:
            showing.cancel()
            self._pages.remove(given)
        return socket

    def _admitted(self, request: web.Request) -> bool:
        """Return whether a page has the token; refuse it if that is wrong, or the page is one too many."""
        given = request.query.get("token", "")
        if given and not hmac.compare_digest(given.encode(), self._token.encode()):
            raise web.HTTPForbidden(text=OTHER_LINK)
        origin = request.headers.get("Origin")
        if origin is not None and origin.partition("://")[2] != request.host:
            raise web.HTTPForbidden(text="another site's page")
        if self._pages.count(bool(given)) >= MOST_PAGES:
            raise web.HTTPServiceUnavailable(text=f"{MOST_PAGES} pages are open already")
        return bool(given)

    def _order(self, socket: web.WebSocketResponse, text: str) -> None:
        """Give the order of a page; a stop is sent first."""
        try:
            asked: dict[str, Any] = json.loads(text)
            order = Order(asked["order"], str(asked.get("formation", "")), reason="the order of a page")
        except (ValueError, TypeError, KeyError):
            return
        if order.verb not in ORDERS or (order.formation and order.formation not in self._plan.swarm.formations):
            return

        def answered(answer: Answer) -> None:
            task = asyncio.create_task(self._answer(socket, order, answer))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

        self._operator.ask(order, answered=answered)

    async def _answer(self, socket: web.WebSocketResponse, order: Order, answer: Answer) -> None:
        reason = answer.refusal or (f"not confirmed by {', '.join(answer.missing)}" if answer.missing else "")
        with contextlib.suppress(ConnectionError):
            await socket.send_json({"answer": {"order": order.verb, "failed": reason, "note": answer.note}})

    async def _operating(self, _: web.Application) -> AsyncIterator[None]:
        operate = partial(self._operator.run, lambda _: None, PERIOD)
        work = ((operate, "cannot continue an order"), (self._draw, "cannot make a picture for the pages"))
        tasks = [asyncio.create_task(_repeated(*one)) for one in work]
        yield
        for task in tasks:
            task.cancel()

    async def _draw(self) -> None:
        """Draw all states for the pages that wait for a picture; pages report missing pictures."""
        if self._pages:
            picture = snapshot(self._plan, self._places, self._operator.statuses, clock.now())
            self._picture = json.dumps(picture, separators=(",", ":"))
            self._drawn.set()
            self._drawn = asyncio.Event()

    async def _send(self, socket: web.WebSocketResponse, request: web.Request) -> None:
        """Send each picture that a page has time for; disconnect it without waiting if it accepts nothing."""
        with contextlib.suppress(TimeoutError, ConnectionError):
            while await self._drawn.wait():
                await asyncio.wait_for(socket.send_str(self._picture), LONGEST_SEND)
        if request.transport is not None:
            request.transport.abort()


async def _repeated(work: Callable[[], Awaitable[object]], failure: str) -> None:
    """Repeat `work` after each PERIOD; log a failure once, and again if it comes back."""
    failed = ""
    while True:
        began = clock.monotonic()
        try:
            await work()
            failed = ""
        except Exception as error:
            if repr(error) != failed or clock.monotonic() - began > nanoseconds(PERIOD):  # it went well for a while
                logging.getLogger(CONSOLE.kind).exception(failure)
            failed = repr(error)
        await asyncio.sleep(PERIOD)


def _files() -> dict[str, tuple[str, str]]:
    """Return the page's files by path, each with its type: its own, and what it shares with the replay page."""
    return {
        "/": (filled(PAGE / "index.html"), "text/html"),
        "/style.css": (joined("style.css"), "text/css"),
        "/orders.css": (joined(PAGE / "orders.css"), "text/css"),
        "/scene.js": (joined(*SCRIPTS), "text/javascript"),
        "/app.js": (joined(PAGE / "app.js"), "text/javascript"),
    }


def is_own(host: str, names: frozenset[str]) -> bool:
    """Return whether `host`, a Host header, is an IP address or one of `names`, with any port."""
    found = _HOST.fullmatch(host)
    if found is None:
        return False
    try:
        ipaddress.ip_address(found["v6"] or found["name"])
    except ValueError:
        return (found["name"] or "").lower() in names
    return True
