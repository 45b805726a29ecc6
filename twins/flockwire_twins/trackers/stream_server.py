"""A tracker's twin on TCP: each client has a conversation of its own, and gets every frame."""

from __future__ import annotations

import asyncio
import contextlib
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
        self._server: asyncio.Server
        self._clients: dict[asyncio.StreamWriter, Conversation] = {}

    async def open(self) -> None:
        """Listen; raises OSError if the port is taken or the address is not there."""
        self._server = await asyncio.start_server(self._serve, self._address, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Close all connections."""
        self._server.close()
        for writer in self._clients:
            writer.close()

    async def dial(self, host: str, port: int) -> None:
        """Connect to a client that waits at its port; raises OSError if it does not."""
        await asyncio.get_running_loop().create_connection(
            lambda: asyncio.StreamReaderProtocol(asyncio.StreamReader(), self._serve), host, port
        )

    def publish(self, frame: TrackerFrame) -> None:
        """Send a frame to all clients that want it."""
        for writer, conversation in self._clients.items():
            conversation.publish(frame)
            _flush(writer, conversation)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Talk with a client until it ends the connection, or nothing more can be read of it."""
        conversation = self._clients[writer] = self._converse(writer.get_extra_info("peername")[0])
        _flush(writer, conversation)
        try:
            with contextlib.suppress(OSError):  # the client is gone
                while conversation.failed is None and (data := await reader.read(1 << 16)):
                    conversation.receive(data)
                    _flush(writer, conversation)
        finally:
            del self._clients[writer]
            writer.close()


def _flush(writer: asyncio.StreamWriter, conversation: Conversation) -> None:
    writer.write(conversation.outgoing())
    if writer.transport.get_write_buffer_size() > 1 << 20:  # bytes; a client that reads so little is disconnected
        writer.transport.abort()
