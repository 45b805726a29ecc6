"""The socket of a VRPN client: it carries bytes to and from a `VrpnConnection`, and reconnects when it is lost."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

from flockwire import clock

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.reports import Reports
from flockwire_mocap.vrpn.wire import PORT

PAUSE = 1.0  # s between two attempts to connect
PATIENCE = 3.0  # s for the server to accept

Deliver = Callable[[TrackerFrame, int], None]


class VrpnClient:
    """Receives the pose reports of a VRPN server, and passes each on with the time of its arrival (Unix ns).

    Attributes:
        connection: the newest connection, with what it has counted.
        reports: what came over all connections.
        trouble: why there is no connection, and what to do, in one line; None while there is one.

    """

    def __init__(self, host: str, deliver: Deliver, port: int = PORT) -> None:
        self.connection = VrpnConnection()
        self.reports = Reports()
        self.trouble: str | None = f"{host}:{port} has not been connected yet"
        self._host, self._port, self._deliver = host, port, deliver
        self._task: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Begin to connect, and keep at it until `close`."""
        self._task = asyncio.get_running_loop().create_task(self._keep_connected())

    async def close(self) -> None:
        """Close the connection."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    def receive(self, data: bytes) -> bytes:
        """Take in bytes of the connection; returns those to be sent."""
        now = clock.now()
        for pose in self.connection.receive(data):
            frame = self.reports.frame(pose)
            if frame is not None:
                self._deliver(frame, now)
        return self.connection.outgoing()

    async def _keep_connected(self) -> None:
        while True:
            try:
                async with asyncio.timeout(PATIENCE):
                    transport, link = await self._connect()
            except OSError as error:  # a time-out is one too
                reason = str(error) or "no answer"
                self.trouble = f"{self._host}:{self._port} cannot be reached ({reason}): check address, port, firewall"
            else:
                self.trouble = None
                try:
                    await link.lost.wait()
                finally:
                    transport.close()
                self.trouble = (
                    f"{self._host}:{self._port} closed: {self.connection.failed or 'the server has ended it'}"
                )
            await asyncio.sleep(PAUSE)

    async def _connect(self) -> tuple[asyncio.Transport, _Link]:
        self.connection = VrpnConnection()
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
        transport.write(self._client.connection.outgoing())

    def data_received(self, data: bytes) -> None:
        answer = self._client.receive(data)
        if self._transport is None:
            return
        if answer:
            self._transport.write(answer)
        if self._client.connection.failed is not None:
            self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set()
