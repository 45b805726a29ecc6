"""Serves a simulated Tello on UDP."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from random import Random
from typing import cast

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.ending import Ending

from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.tello import Address, SimulatedTello


class TelloServer(asyncio.DatagramProtocol):
    """Moves datagrams between one socket and one simulated Tello, and calls it when it is due."""

    def __init__(self, tello: SimulatedTello) -> None:
        self._tello = tello
        self._timer: asyncio.TimerHandle | None = None
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        self._transport = cast("asyncio.DatagramTransport", transport)
        self._run()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._transport = None
        if self._timer is not None:
            self._timer.cancel()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Pass a command on."""
        self._tello.receive(data, addr, clock.monotonic())
        self._run()

    def error_received(self, exc: Exception) -> None:
        """Ignore that no client listens, like a drone."""

    def _run(self) -> None:
        if self._transport is None:
            return
        for datagram, address in self._tello.outgoing(clock.monotonic()):
            self._transport.sendto(datagram, address)
        if self._timer is not None:
            self._timer.cancel()
        wait = max(0.0, (self._tello.next_deadline() - clock.monotonic()) / SECOND)
        self._timer = asyncio.get_running_loop().call_later(wait, self._run)


def bound(address: Address) -> socket.socket:
    """Return a socket bound only to `address`; a client on the same host may share its port.

    Raises OSError if the address is not this host's, or in use by another simulated Tello or an earlier client.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(address)  # SO_REUSEADDR alone would let two simulated Tellos bind it
        address = probe.getsockname()
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind(address)
        found.setblocking(False)
    except OSError:
        found.close()
        raise
    return found


async def serve(
    parameters: TelloParameters,
    address: Address,
    seed: int,
    note: Callable[[str], None],
) -> None:
    """Serve one simulated Tello on `address` until Ctrl-C or SIGTERM.

    Calls `note` with lines for whoever watches it: first with the bound address.

    Raises OSError if it cannot be bound.
    """
    ended, sock = Ending().ended, bound(address)
    tello = SimulatedTello(parameters, clock.monotonic(), Random(seed).random, note)  # noqa: S311  (no secret)
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(lambda: TelloServer(tello), sock=sock)
    try:
        (host, port), quirks = sock.getsockname(), ", ".join(sorted(parameters.quirks)) or "none"
        note(
            f"simulated Tello (SDK {parameters.generation}) at {host}:{port}, state to port {parameters.state_port} of "
            f"its client, quirks: {quirks}; Ctrl-C ends it"
        )
        await ended.wait()
    finally:
        transport.close()
