"""The socket of a VRPN client: it carries bytes of a `VrpnConnection`, and reconnects after a loss."""

from __future__ import annotations

import asyncio
import socket

from flockwire_core import clock

from flockwire_mocap.persistent import PersistentConnection, keep_alive
from flockwire_mocap.vrpn.source import VrpnSource


class VrpnClient(PersistentConnection[VrpnSource]):
    """Feeds a source with the pose reports of its server."""

    def receive(self, data: bytes) -> bytes:
        """Receive bytes of the connection; returns those to be sent."""
        self.source.read(data, clock.now())
        self._drained()
        return self.source.connection.outgoing()

    async def connected(self) -> str:
        """Connect, and return the reason when the connection fails or is lost."""
        source, where = self.source, f"{self.source.table.server}:{self.source.table.port}"
        try:
            async with asyncio.timeout(3.0):  # s for the server to accept
                transport, link = await self._connect()
        except OSError as error:  # a time-out is one too
            return f"{where} cannot be reached ({str(error) or 'no answer'}): check address, port, firewall"
        source.failure = ""
        try:
            await link.lost.wait()
        finally:
            transport.close()
        return f"{where} closed: {source.connection.failed or 'the server has ended it, or is gone'}"

    async def _connect(self) -> tuple[asyncio.Transport, _Link]:
        self.source.reconnect()
        link = _Link(self)
        table, loop = self.source.table, asyncio.get_running_loop()
        transport, _ = await loop.create_connection(lambda: link, table.server, table.port)
        return transport, link


class _Link(asyncio.Protocol):
    def __init__(self, client: VrpnClient) -> None:
        self.lost = asyncio.Event()
        self._client = client
        self._transport: asyncio.WriteTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport)  # noqa: S101 for the type: TCP can be written to
        self._transport = transport
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        keep_alive(transport)
        transport.write(self._client.source.connection.outgoing())

    def data_received(self, data: bytes) -> None:
        answer = self._client.receive(data)
        if self._transport is None:
            return
        if answer:
            self._transport.write(answer)
        if self._client.source.connection.failed is not None:
            self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set()
