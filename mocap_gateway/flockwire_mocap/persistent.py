"""Connections to trackers: they reconnect after each loss, and notice a silent end; packages of extras are imported."""

from __future__ import annotations

import asyncio
import importlib
import logging
import socket
from abc import abstractmethod
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any, ClassVar, Generic, TypeVar

from flockwire_core.extras import remedy
from flockwire_core.wire.processes import GATEWAY

from flockwire_mocap.streamed import StreamedSource

Streamed = TypeVar("Streamed", bound=StreamedSource)


class PersistentConnection(AbstractAsyncContextManager[None], Generic[Streamed]):
    """Connects, and reconnects `PAUSE` s after each end, for any reason, which `source` reports.

    It feeds `source`, and calls `drained` after all that had arrived.
    """

    PAUSE: ClassVar[float] = 1.0

    def __init__(self, source: Streamed, drained: Callable[[], None]) -> None:
        self.source, self._drained = source, drained
        self._task: asyncio.Task[None]

    async def __aenter__(self) -> None:
        self._task = asyncio.get_running_loop().create_task(self._keep_connected())

    async def __aexit__(self, *_: object) -> None:
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    @abstractmethod
    async def connected(self) -> str:
        """Connect, and return when the connection fails or is lost: reason and remedy in one line."""

    async def _keep_connected(self) -> None:
        logged = ""
        while True:
            try:
                why = await self.connected()
            except Exception as error:  # an error of any kind is reported, and does not end the attempts
                why = f"the connection failed: {error!r}"
                if why != logged:
                    logging.getLogger(GATEWAY.kind).exception("the connection to the tracker failed")
                logged = why
            self.source.failure = why
            await asyncio.sleep(self.PAUSE)


def imported(module: str, extra: str) -> Any:  # noqa: ANN401  (any module)
    """Return the module of that name; raises OSError with the extra of flockwire that brings it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        line = f"gateway.source = {extra!r} needs the package {module.replace('_', '-')}"
        raise OSError(f"{line}: {remedy(extra)} ({error})") from None


SILENCE = 3  # s without a sign of the other end, after which the connection is lost


def keep_alive(transport: asyncio.BaseTransport) -> None:
    """Have the kernel probe the other end every second while nothing comes, and end the connection after SILENCE s.

    The other end's kernel answers the probes, so that a server which sees no body, and has nothing to report, keeps its
    connection. A time-out for data could not distinguish that from a server that is gone.
    """
    link = transport.get_extra_info("socket")
    link.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    options = {
        "TCP_KEEPIDLE": 1,  # s
        "TCP_KEEPALIVE": 1,  # s: what macOS calls it
        "TCP_KEEPINTVL": 1,  # s
        "TCP_KEEPCNT": SILENCE,
        "TCP_USER_TIMEOUT": 1000 * SILENCE,  # ms; while own data is unanswered nothing is probed
    }
    for name, value in options.items():
        if hasattr(socket, name):
            link.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
