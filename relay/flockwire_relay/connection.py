"""One connection through a relay: two sockets, and the bytes from each to the other."""

from __future__ import annotations

import asyncio
import contextlib

from flockwire_relay.direction import END, Direction, Stream

LARGEST = 65_536  # bytes of one read


class Pipe:
    """The bytes of one connection in one direction, from a reader to a writer."""

    def __init__(self, direction: Direction) -> None:
        self._stream = Stream(direction)
        self._changed, self._room = asyncio.Event(), asyncio.Event()

    @property
    def held(self) -> int:
        """The number of held bytes."""
        return self._stream.size

    def check(self) -> None:
        """Check the held bytes again: the link changed."""
        self._changed.set()

    async def fill(self, reader: asyncio.StreamReader) -> None:
        """Receive bytes up to their end, while there is room; a reset is an end."""
        data = None
        while data != END:
            try:
                data = await reader.read(LARGEST)
            except ConnectionError:
                data = END
            self._stream.take(data, asyncio.get_running_loop().time())
            self._changed.set()
            while self._stream.full:
                self._room.clear()
                await self._room.wait()

    async def empty(self, writer: asyncio.StreamWriter) -> None:
        """Write the bytes as they become due, then their end; raises OSError if nobody takes them."""
        while True:
            self._changed.clear()
            for data in self._stream.due(asyncio.get_running_loop().time()):
                if data == END:
                    writer.write_eof()
                    return
                writer.write(data)
            self._room.set()
            await writer.drain()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(self._stream.next_arrival()):
                    await self._changed.wait()


class Connection:
    """A dialler's connection, and the one to the listener; made in the task that runs it."""

    def __init__(self, there: Direction, back: Direction) -> None:
        self.pipes = (Pipe(there), Pipe(back))
        self._task = asyncio.current_task()

    def abort(self) -> None:
        """End it at once."""
        if self._task is not None:
            self._task.cancel()

    async def run(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        address: tuple[str, int],
        passable: asyncio.Event,
    ) -> None:
        """Pass on the dialler's bytes, and those of the listener at `address` once the link is `passable`.

        It ends with both directions, when nobody listens, or when the dialler gives up before it is answered.
        """
        there, back = self.pipes
        writers = [writer]
        try:
            async with asyncio.TaskGroup() as group:
                received = group.create_task(there.fill(reader))
                received.add_done_callback(lambda _: self.abort() if len(writers) < 2 else None)
                await passable.wait()
                far_reader, far_writer = await asyncio.open_connection(*address)
                writers.append(far_writer)
                group.create_task(there.empty(far_writer))
                group.create_task(back.fill(far_reader))
                group.create_task(back.empty(writer))
        except* OSError:  # the dialler tries again
            pass
        finally:
            for one in writers:
                one.close()
