"""A VRPN server as a tracker's twin: each body is a sender, its pose goes to every client over TCP."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterable

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.wire import PORT, PoseBody

BACKLOG = 1 << 20  # bytes; a client that reads so little is disconnected


class VrpnServer:
    """Serves frames to VRPN clients; a body that is not tracked is not reported.

    Args:
        names: of the bodies, described to each client when it connects.
        address: IPv4 address of the interface to serve on.
        port: where it listens; 0 takes a free one.

    """

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        self.names = tuple(names)
        self.port = port
        self._address = address
        self._server: asyncio.Server | None = None
        self._clients: set[_Client] = set()

    async def open(self) -> None:
        """Listen; raises OSError if the port is taken or the address is not there."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: _Client(self.names, self._clients), self._address, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Close all connections."""
        if self._server is not None:
            self._server.close()
        for client in tuple(self._clients):
            client.close()

    def publish(self, frame: TrackerFrame) -> None:
        """Report the bodies of a frame to all clients."""
        for client in tuple(self._clients):
            client.report(frame)


class _Client(asyncio.Protocol):
    def __init__(self, names: Iterable[str], clients: set[_Client]) -> None:
        self._names, self._clients = names, clients
        self._connection = VrpnConnection()
        self._transport: asyncio.WriteTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport)  # noqa: S101 for the type: TCP can be written to
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._transport = transport
        self._clients.add(self)
        for name in self._names:
            self._connection.describe(name)
        self._flush()

    def data_received(self, data: bytes) -> None:
        self._connection.receive(data)
        self._flush()
        if self._connection.failed is not None:
            self.close()

    def connection_lost(self, exc: Exception | None) -> None:
        self._clients.discard(self)

    def report(self, frame: TrackerFrame) -> None:
        for body in frame.bodies:
            if body.tracked:
                name = body.name or str(body.identity)
                self._connection.send_pose(name, frame.captured, PoseBody(0, body.position, body.orientation))
        self._flush()

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()

    def _flush(self) -> None:
        if self._transport is None:
            return
        self._transport.write(self._connection.outgoing())
        if self._transport.get_write_buffer_size() > BACKLOG:
            self._transport.abort()
