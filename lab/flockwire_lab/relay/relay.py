"""The relay of one link: the dialler dials it, and it dials the listener.

It passes bytes on and reads nothing: the link is TLS from end to end. What it holds for how long is decided without a
clock of its own: `now` is in s of a clock that does not go back.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable
from random import Random

from flockwire_lab.network import Conditions, DirectedLink

MOST_HELD = 262_144  # bytes of one connection and direction; beyond, reading stops and TCP makes the sender wait
END = b""  # stands for the end of a connection's bytes


class Direction(DirectedLink):
    """One direction of a link; calls `changed` whenever a fault begins or ends."""

    def __init__(self, name: str, changed: Callable[[], None]) -> None:
        super().__init__(Conditions())
        self._random = Random(name)  # noqa: S311  (not for secrets)
        self._changed = changed

    def _update(self) -> None:
        super()._update()
        self._changed()

    def arrival(self, now: float, last: float) -> float:
        """Return the arrival of bytes sent at `now`: not before `last`, that of earlier bytes."""
        present = self.conditions
        return max(now + present.delay + present.jitter * self._random.random(), last)


class Stream:
    """The held bytes of one connection in one direction."""

    def __init__(self, direction: Direction) -> None:
        self._direction = direction
        self.size = 0  # bytes
        self._held: deque[tuple[float, bytes]] = deque()  # with the time of arrival
        self._last = 0.0

    @property
    def full(self) -> bool:
        """Whether no more bytes should be read now."""
        return self.size >= MOST_HELD

    def take(self, data: bytes, now: float) -> None:
        """Receive bytes that were received at `now`, or END."""
        self._last = self._direction.arrival(now, self._last)
        self._held.append((self._last, data))
        self.size += len(data)

    def due(self, now: float) -> list[bytes]:
        """Return and remove the bytes that arrive by `now`, in order."""
        arrived: list[bytes] = []
        while self._direction.passable and self._held and self._held[0][0] <= now:
            arrived.append(self._held.popleft()[1])
            self.size -= len(arrived[-1])
        return arrived

    def next_arrival(self) -> float | None:
        """Return the time of the next due bytes, None if unknown."""
        return self._held[0][0] if self._held and self._direction.passable else None


class Pipe:
    """The bytes of one connection in one direction, from a reader to a writer."""

    def __init__(self, direction: Direction) -> None:
        self.stream = Stream(direction)
        self.changed, self._room = asyncio.Event(), asyncio.Event()  # held bytes or the link changed; there is room

    async def fill(self, reader: asyncio.StreamReader) -> None:
        """Receive bytes up to their end, while there is room; any failure is an end."""
        largest = 65_536  # bytes of one read
        data = None
        while data != END:
            try:
                data = await reader.read(largest)
            except OSError:
                data = END
            self.stream.take(data, asyncio.get_running_loop().time())
            self.changed.set()
            while self.stream.full:
                self._room.clear()
                await self._room.wait()

    async def empty(self, writer: asyncio.StreamWriter) -> None:
        """Write the bytes as they become due, then their end; end earlier if nobody takes them."""
        with contextlib.suppress(OSError):
            while await self._write_due(writer):
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout_at(self.stream.next_arrival()):
                        await self.changed.wait()

    async def _write_due(self, writer: asyncio.StreamWriter) -> bool:
        """Write what is due; returns whether more may follow."""
        self.changed.clear()
        for data in self.stream.due(asyncio.get_running_loop().time()):
            if data == END:
                writer.write_eof()
                return False
            if writer.is_closing():
                return False
            writer.write(data)
        self._room.set()
        await writer.drain()
        return True


class Connection:
    """A dialler's connection to `relay`, and the one to the listener; made in the task that runs it."""

    def __init__(self, relay: Relay) -> None:
        self.pipes = (Pipe(relay.there), Pipe(relay.back))
        self._relay = relay
        self._task = asyncio.current_task()
        self._writers: list[asyncio.StreamWriter] = []  # to the dialler, then to the listener

    def abort(self) -> None:
        """End it at once; bytes that are not sent yet are lost."""
        for writer in self._writers:
            writer.transport.abort()
        if self._task is not None:
            self._task.cancel()

    async def run(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Pass on the dialler's bytes, and those of the listener once the link is passable.

        It ends when each direction has ended or has nobody who takes its bytes, when nobody listens, or when the
        dialler gives up before it is answered.
        """
        there, back = self.pipes
        self._writers.append(writer)
        try:
            async with asyncio.TaskGroup() as group:
                filling = [group.create_task(there.fill(reader))]
                filling[0].add_done_callback(lambda _: self.abort() if len(self._writers) < 2 else None)
                await self._relay.passable.wait()
                far_reader, far_writer = await asyncio.open_connection(*self._relay.address)
                self._writers.append(far_writer)
                filling.append(group.create_task(back.fill(far_reader)))
                await asyncio.wait([group.create_task(there.empty(far_writer)), group.create_task(back.empty(writer))])
                for one in filling:
                    one.cancel()
        except* OSError:  # the dialler tries again
            pass
        finally:
            for each in self._writers:
                each.close()


HERE = "127.0.0.1"  # the dialler is on this host, and every certificate is good for loopback
MOST_CONNECTIONS = 8  # the dialler needs one; beyond, the oldest is closed


class Relay:
    """Relays between `dialler` and `listener`, which listens at `address` (IP, port)."""

    def __init__(self, dialler: str, listener: str, address: tuple[str, int]) -> None:
        self.there = Direction(f"{dialler} > {listener}", self._changed)
        self.back = Direction(f"{listener} > {dialler}", self._changed)
        self.address = address
        self.passable = asyncio.Event()  # set while both directions are, as TCP needs it for a new connection
        self.passable.set()
        self.connections: list[Connection] = []
        self._server: asyncio.Server | None = None

    async def start(self) -> str:
        """Listen; returns the `IP:PORT` to dial."""
        self._server = await asyncio.start_server(self._accept, HERE, 0)
        return f"{HERE}:{self._server.sockets[0].getsockname()[1]}"

    def end(self) -> None:
        """Close everything at once."""
        if self._server is not None:
            self._server.close()
        for connection in self.connections:
            connection.abort()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self.connections) >= MOST_CONNECTIONS:
            self.connections.pop(0).abort()
        connection = Connection(self)
        self.connections.append(connection)
        try:
            await connection.run(reader, writer)
        finally:
            if connection in self.connections:
                self.connections.remove(connection)

    def _changed(self) -> None:
        """Pass on due bytes."""
        if self.there.passable and self.back.passable:
            self.passable.set()
        else:
            self.passable.clear()
        for connection in self.connections:
            for pipe in connection.pipes:
                pipe.changed.set()
