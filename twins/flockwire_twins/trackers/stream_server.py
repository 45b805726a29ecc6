"""A tracker's twin on TCP: each client has a conversation of its own, and gets every frame."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Protocol

from flockwire_mocap.tracking import TrackerFrame


class Conversation(Protocol):
    """One client's conversation without a socket; `failed`: why nothing more can be read of it, None while it can."""

    failed: str | None

    def receive(self, data: bytes) -> object:
        """Receive bytes, split anywhere."""

    def publish(self, frame: TrackerFrame) -> None:
        """Have a frame sent, if the client wants it."""

    def outgoing(self) -> bytes:
        """Return the bytes to be sent since the last call."""


class StreamServer:
    """Serves frames to clients, each of which gets a conversation of its own.

    Args:
        converse: makes the conversation with a client that has connected, of this host.
        address: IPv4 address of the interface to serve on.
        port: where it listens; 0 takes a free one.

    """

    def __init__(self, converse: Callable[[str], Conversation], address: str, port: int) -> None:
        self.port = port
        self._converse, self._address = converse, address
        self._server: asyncio.Server | None = None
        self._clients: set[_Client] = set()

    async def open(self) -> None:
        """Listen; raises OSError if the port is taken or the address is not there."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: _Client(self._converse, self._clients), self._address, self.port
        )
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Close all connections."""
        if self._server is not None:
            self._server.close()
        for client in tuple(self._clients):
            client.close()

    async def dial(self, host: str, port: int) -> None:
        """Connect to a client that waits at its port; raises OSError if it does not."""
        await asyncio.get_running_loop().create_connection(lambda: _Client(self._converse, self._clients), host, port)

    def publish(self, frame: TrackerFrame) -> None:
        """Send a frame to all clients that want it."""
        for client in tuple(self._clients):
            client.publish(frame)


class _Client(asyncio.Protocol):
    def __init__(self, converse: Callable[[str], Conversation], clients: set[_Client]) -> None:
        self._converse, self._clients = converse, clients
        self._conversation: Conversation
        self._transport: asyncio.WriteTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport)  # noqa: S101 for the type: TCP can be written to
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._transport, self._conversation = transport, self._converse(transport.get_extra_info("peername")[0])
        self._clients.add(self)
        self._flush()

    def data_received(self, data: bytes) -> None:
        self._conversation.receive(data)
        self._flush()
        if self._conversation.failed is not None:
            self.close()

    def connection_lost(self, exc: Exception | None) -> None:
        self._clients.discard(self)

    def publish(self, frame: TrackerFrame) -> None:
        """Send what the client gets of a frame."""
        self._conversation.publish(frame)
        self._flush()

    def close(self) -> None:
        """End the connection."""
        if self._transport is not None:
            self._transport.close()

    def _flush(self) -> None:
        if self._transport is None:
            return
        self._transport.write(self._conversation.outgoing())
        if self._transport.get_write_buffer_size() > 1 << 20:  # bytes; a client that reads so little is disconnected
            self._transport.abort()
