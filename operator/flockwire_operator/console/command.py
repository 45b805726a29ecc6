"""Serves the page, and Foxglove and Lichtblick if requested, until it is interrupted.

Their protocol (foxglove.sdk.v1) is that of foxglove-sdk, in its own threads: unchanged payloads with their ROS 2
schemas. Its clients are read-only.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import AsyncExitStack, closing, contextmanager
from pathlib import Path

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError
from aiohttp.log import server_logger
from flockwire_core import clock
from flockwire_core.extras import remedy
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.topics import Topic, in_order
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import CONSOLE
from flockwire_core.wire.schemas import schema_text

from flockwire_operator.console.server import Pages
from flockwire_operator.station.connecting import connected
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.interrupts import interrupts


class FoxgloveServer:
    """Serves at `address` and `port` the topics to which the process of `session` subscribes.

    Port 0 means any free port: `port` is the actual one. The constructor raises InputError.
    """

    def __init__(self, session: Session, address: str, port: int) -> None:
        plan = session.plan
        try:
            import foxglove  # noqa: PLC0415  (an extra)
        except ImportError as error:
            line = f"--foxglove = {port}: needs the package foxglove-sdk: {remedy('foxglove')}"
            raise InputError(f"{line} ({error})") from None
        self._context = context = foxglove.Context()  # kept, because the channels need it
        try:
            self._server = foxglove.start_server(name=plan.swarm.name, host=address, port=port, context=context)
        except RuntimeError as error:
            reason = str(error).removeprefix("FoxgloveError: ")  # the SDK's
            raise InputError(f"--foxglove = {port}: cannot listen at {address}:{port}: {reason}") from None
        self.port = self._server.port
        self._rejected: Counter[str] = Counter()
        self._topics = [Topic(plan, key, session) for key in plan.subscribes[session.identity]]
        self._channels = {
            topic.name: foxglove.Channel(
                topic.name,
                schema=foxglove.Schema(
                    name=topic.ros_type, encoding="ros2msg", data=schema_text(topic.ros_type).encode()
                ),
                message_encoding="cdr",
                context=context,
            )
            for topic in self._topics
        }

    def forward(self, now: int) -> None:
        """Pass on the messages received by `now` (Unix ns); call it at least ten times a second."""
        for sent, topic, _, _, payload in in_order(self._topics, now, self._rejected):
            self._channels[topic].log(payload, log_time=max(0, sent))

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


UNSAFE_PORT = "--port = {port}: browsers refuse to open this port (ERR_UNSAFE_PORT); choose another, like 8420"
UNSAFE = frozenset({  # the "bad ports" of https://fetch.spec.whatwg.org
    1, 7, 9, 11, 13, 15, 17, 19, 20, 21, 22, 23, 25, 37, 42, 43, 53, 69, 77, 79, 87, 95, 101, 102, 103, 104, 109, 110,
    111, 113, 115, 117, 119, 123, 135, 137, 139, 143, 161, 179, 389, 427, 465, 512, 513, 514, 515, 526, 530, 531, 532,
    540, 548, 554, 556, 563, 587, 601, 636, 989, 990, 993, 995, 1719, 1720, 1723, 2049, 3659, 4045, 4190, 5060, 5061,
    6000, 6566, 6665, 6666, 6667, 6668, 6669, 6679, 6697, 10080,
})  # fmt: skip
MALFORMED = "{count} malformed requests were dropped"


@contextmanager
def malformed_counted() -> Iterator[None]:
    """Count requests that are not HTTP during the context, and say how many they were, without their tracebacks."""
    count = 0

    def is_well_formed(record: logging.LogRecord) -> bool:
        nonlocal count
        malformed = record.exc_info is not None and isinstance(record.exc_info[1], HttpProcessingError)
        count += malformed
        return not malformed

    server_logger.addFilter(is_well_formed)
    try:
        yield
    finally:
        server_logger.removeFilter(is_well_formed)
        if count:
            print(f"flockwire: warning: {MALFORMED.format(count=count)}", file=sys.stderr)


async def serve(plan: Plan, keys: Path, address: str, port: int, foxglove: int | None = None) -> bool:
    """Serve the pages of a swarm at `address`, and Foxglove at the port `foxglove` of it, None: not at all.

    Returns False if it was interrupted before the router answered. Raises OSError if the port cannot be opened, and
    InputError.
    """
    poll = 0.1  # s
    if port in UNSAFE:
        print(f"flockwire: warning: {UNSAFE_PORT.format(port=port)}", file=sys.stderr)
    token = secrets.token_urlsafe(16)
    async with AsyncExitStack() as stack:
        interrupted = stack.enter_context(interrupts())
        session = await connected(plan, CONSOLE.kind, keys, interrupted)
        if session is None:
            return False
        stack.enter_context(session)
        host = f"[{address}]" if ":" in address else address
        viewers = None
        if foxglove is not None:
            viewers = stack.enter_context(closing(FoxgloveServer(session, address, foxglove)))
        pages = Pages(plan, Operator(session), token, address)
        stack.enter_context(malformed_counted())
        runner = web.AppRunner(pages.application(), access_log=None)
        await runner.setup()
        stack.push_async_callback(runner.cleanup)
        await web.TCPSite(runner, address, port).start()
        print(f"flockwire: http://{host}:{port}/#{token}", flush=True)
        if viewers is not None:
            print(f"flockwire: Foxglove and Lichtblick: ws://{host}:{viewers.port}", flush=True)
        while not interrupted.count:
            if viewers is not None:
                viewers.forward(clock.now())
            await asyncio.sleep(poll)
    return True
