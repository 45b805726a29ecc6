"""The UDP sockets of a core that exchanges datagrams."""

from __future__ import annotations

import asyncio
import contextlib
import errno
from collections.abc import AsyncIterator, Callable
from functools import partial

from flockwire_core import clock
from flockwire_core.process.cores import Address, Core, Networked
from flockwire_core.runtime.session import EndpointInUseError


class Sockets:
    """The sockets of `core`, bound and served in the running loop."""

    def __init__(self, core: Networked) -> None:
        self.time: Callable[[int], int] = lambda now: now  # the core's (process/stepping.py)
        self._core = core
        self._transports: dict[Address, asyncio.DatagramTransport] = {}

    async def open(self) -> None:
        """Bind all; raises EndpointInUseError."""
        loop = asyncio.get_running_loop()
        for address in self._core.sockets:
            try:
                transport, _ = await loop.create_datagram_endpoint(partial(_Socket, self, self._core, address), address)
            except OSError as error:
                raise EndpointInUseError(_reason(address, error)) from None
            self._transports[address] = transport

    def close(self) -> None:
        """Close all."""
        for transport in self._transports.values():
            transport.close()
        self._transports.clear()

    def flush(self, now: int) -> None:
        """Send the core's datagrams at `now` (Unix ns)."""
        for data, source, target in self._core.outgoing(now):
            transport = self._transports.get(source)
            if transport is not None:
                transport.sendto(data, target)


class _Socket(asyncio.DatagramProtocol):
    def __init__(self, sockets: Sockets, core: Networked, address: Address) -> None:
        self._sockets, self._core, self._address = sockets, core, address

    def datagram_received(self, data: bytes, addr: Address) -> None:
        """Receive a datagram, and send the core's datagrams."""
        now = self._sockets.time(clock.now())
        self._core.datagram(data, addr, self._address, now)
        self._sockets.flush(now)

    def error_received(self, exc: Exception) -> None:
        """Ignore a closed port or a missing route: the core detects missing replies."""


@contextlib.asynccontextmanager
async def serve(core: Core) -> AsyncIterator[Sockets | None]:
    """Serve the sockets of `core` during the context; None for a core without sockets. Raises EndpointInUseError."""
    if not isinstance(core, Networked) or not core.sockets:
        yield None
        return
    sockets = Sockets(core)
    try:
        await sockets.open()
        yield sockets
    finally:
        sockets.close()


def _reason(address: Address, error: OSError) -> str:
    where = f"{address[0]}, port {address[1]}"
    if error.errno == errno.EADDRINUSE:
        return f"cannot bind UDP {where}: it is in use; end the other client or driver that has it (ss -ulnp names it)"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"cannot bind UDP {where}: this host has no such address; `ip addr add {address[0]} dev DEVICE` adds it"
    return f"cannot bind UDP {where}: {error.strerror}"
