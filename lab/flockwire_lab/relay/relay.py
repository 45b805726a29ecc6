"""The relay of one link: the dialler dials it, and it dials the listener.

It passes bytes on and reads nothing: the link is TLS from end to end.
"""

from __future__ import annotations

import asyncio

from flockwire_lab.relay.connection import Connection
from flockwire_lab.relay.direction import Direction

HERE = "127.0.0.1"  # the dialler is on this host, and every certificate is good for loopback
MOST_CONNECTIONS = 8  # the dialler needs one; beyond, the oldest is closed


class Relay:
    """Relays between `dialler` and `listener`, which listens at `address` (IP, port)."""

    def __init__(self, dialler: str, listener: str, address: tuple[str, int]) -> None:
        self.there = Direction(f"{dialler} > {listener}", self._changed)
        self.back = Direction(f"{listener} > {dialler}", self._changed)
        self._address = address
        self._passable = asyncio.Event()
        self._passable.set()
        self._connections: list[Connection] = []
        self._server: asyncio.Server | None = None

    async def start(self) -> str:
        """Listen; returns the `IP:PORT` to dial."""
        self._server = await asyncio.start_server(self._accept, HERE, 0)
        return f"{HERE}:{self._server.sockets[0].getsockname()[1]}"

    @property
    def connections(self) -> int:
        """The number of connections, including those that wait."""
        return len(self._connections)

    @property
    def held(self) -> int:
        """The held bytes of all connections, in both directions."""
        return sum(pipe.held for connection in self._connections for pipe in connection.pipes)

    def end(self) -> None:
        """Close everything at once."""
        if self._server is not None:
            self._server.close()
        for connection in self._connections:
            connection.abort()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._connections) >= MOST_CONNECTIONS:
            self._connections.pop(0).abort()
        connection = Connection(self.there, self.back)
        self._connections.append(connection)
        try:
            await connection.run(reader, writer, self._address, self._passable)
        finally:
            if connection in self._connections:
                self._connections.remove(connection)

    def _changed(self) -> None:
        """Pass on due bytes; a new connection needs both directions, as in TCP."""
        if self.there.passable and self.back.passable:
            self._passable.set()
        else:
            self._passable.clear()
        for connection in self._connections:
            for pipe in connection.pipes:
                pipe.check()
