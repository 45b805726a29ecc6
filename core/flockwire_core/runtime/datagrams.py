"""The UDP sockets of a core that exchanges datagrams."""

from __future__ import annotations

import asyncio
import errno
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from functools import partial

from flockwire_core import clock
from flockwire_core.process.cores import Address, Core, Networked
from flockwire_core.process.stepping import Stepper
from flockwire_core.runtime.job import Job
from flockwire_core.runtime.session import EndpointInUseError
from flockwire_core.runtime.shell import Shell, run_core


class Sockets:
    """The sockets of `core`, served in the running loop; `time` returns the core's time (process/stepping.py)."""

    def __init__(self, core: Networked, time: Callable[[int], int]) -> None:
        self.core, self.time = core, time
        self.transports: dict[Address, asyncio.DatagramTransport] = {}

    def flush(self, now: int) -> None:
        """Send the core's datagrams at `now` (Unix ns)."""
        for data, source, target in self.core.outgoing(now):
            transport = self.transports.get(source)
            if transport is not None:
                transport.sendto(data, target)


class _Socket(asyncio.DatagramProtocol):
    def __init__(self, sockets: Sockets, address: Address) -> None:
        self._sockets, self._address = sockets, address

    def datagram_received(self, data: bytes, addr: Address) -> None:
        """Receive a datagram, and send the core's datagrams."""
        now = self._sockets.time(clock.now())
        self._sockets.core.datagram(data, addr, self._address, now)
        self._sockets.flush(now)

    def error_received(self, exc: Exception) -> None:
        """Ignore a closed port or a missing route: the core detects missing replies."""


def feed(core: Core, shell: Shell) -> AbstractAsyncContextManager[None] | None:
    """Return the context in which the sockets of `core` are served; None for a core without sockets."""
    return _served(core, shell.stepper) if isinstance(core, Networked) and core.sockets else None


@asynccontextmanager
async def _served(core: Networked, stepper: Stepper) -> AsyncIterator[None]:
    """Serve the sockets of `core` during the context. Raises EndpointInUseError."""
    sockets, loop = Sockets(core, stepper.time), asyncio.get_running_loop()
    try:
        for address in core.sockets:
            try:
                transport, _ = await loop.create_datagram_endpoint(partial(_Socket, sockets, address), address)
            except OSError as error:
                raise EndpointInUseError(_reason(address, error)) from None
            sockets.transports[address] = transport
        stepper.flush = sockets.flush
        yield
    finally:
        for transport in sockets.transports.values():
            transport.close()
        sockets.transports.clear()


async def run(job: Job) -> None:
    """Run a core that may have sockets until the process must end; raises EndpointInUseError."""
    await run_core(job, feed)


def _reason(address: Address, error: OSError) -> str:
    where = f"{address[0]}, port {address[1]}"
    if error.errno == errno.EADDRINUSE:
        return f"cannot bind UDP {where}: it is in use; end the other client or driver that has it (ss -ulnp names it)"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"cannot bind UDP {where}: this host has no such address; `ip addr add {address[0]} dev DEVICE` adds it"
    return f"cannot bind UDP {where}: {error.strerror}"
