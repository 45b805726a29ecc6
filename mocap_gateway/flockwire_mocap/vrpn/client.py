"""The socket of a VRPN client: it carries bytes of a `VrpnConnection`, and reconnects after a loss."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

from flockwire import clock

from flockwire_mocap.keep_alive import keep_alive
from flockwire_mocap.persistent import PersistentConnection
from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.session import VrpnSession
from flockwire_mocap.vrpn.wire import PORT

ACCEPT_TIMEOUT = 3.0  # s for the server to accept

Deliver = Callable[[TrackerFrame, int], None]


class VrpnClient(PersistentConnection):
    """Receives the pose reports of a VRPN server, and passes each on with the time of its arrival (Unix ns).

    Args:
        host: name or address of the server. deliver: called in the event loop with each report that is newer than all
        before of its body. port: of the server. session: the state of the server.
        drained: called after all that had arrived was delivered.

    """

    def __init__(
        self,
        host: str,
        deliver: Deliver,
        port: int = PORT,
        session: VrpnSession | None = None,
        drained: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__()
        self.session = session or VrpnSession(f"{host}:{port} has not been connected yet")
        self._host, self._port, self._deliver, self._drained = host, port, deliver, drained

    def receive(self, data: bytes) -> bytes:
        """Receive bytes of the connection; returns those to be sent."""
        now = clock.now()
        for frame in self.session.receive(data):
            self._deliver(frame, now)
        self._drained()
        return self.session.connection.outgoing()

    def failed(self, why: str) -> None:
        """Record the reason of the failure."""
        self.session.trouble = why

    async def connected(self) -> str:
        """Connect, and return the reason when the connection fails or is lost."""
        session, where = self.session, f"{self._host}:{self._port}"
        try:
            async with asyncio.timeout(ACCEPT_TIMEOUT):
                transport, link = await self._connect()
        except OSError as error:  # a time-out is one too
            return f"{where} cannot be reached ({str(error) or 'no answer'}): check address, port, firewall"
        session.trouble = None
        try:
            await link.lost.wait()
        finally:
            transport.close()
        return f"{where} closed: {session.connection.failed or 'the server has ended it, or is gone'}"

    async def _connect(self) -> tuple[asyncio.Transport, _Link]:
        self.session.reconnect()
        link = _Link(self)
        transport, _ = await asyncio.get_running_loop().create_connection(lambda: link, self._host, self._port)
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
        transport.write(self._client.session.connection.outgoing())

    def data_received(self, data: bytes) -> None:
        answer = self._client.receive(data)
        if self._transport is None:
            return
        if answer:
            self._transport.write(answer)
        if self._client.session.connection.failed is not None:
            self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set()
