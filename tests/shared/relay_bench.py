"""A relay between real sockets on loopback, and what tests of it need."""

import asyncio
import contextlib

from flockwire_lab.relay.relay import Relay
from waiting import until

PATIENCE = 10.0  # s after which a test that waits has failed
ROUNDS = 50  # of the loop, in which whatever is wrongly let through would arrive


class Listener:
    """Listens, keeps what each connection said, and can answer."""

    def __init__(self):
        self.said = []
        self.writers = []
        self.ends = 0

    async def heard(self, reader, writer):
        place = len(self.said)
        self.said.append(b"")
        self.writers.append(writer)
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(65536):
                self.said[place] += data
        self.ends += 1


class Bench:
    """A relay with a listener behind it, and diallers in front of it."""

    @property
    def held(self) -> int:
        """The held bytes of all connections, in both directions."""
        return sum(pipe.stream.size for connection in self.relay.connections for pipe in connection.pipes)

    async def __aenter__(self):
        self.listener, self.diallers = Listener(), []
        self.server = await asyncio.start_server(self.listener.heard, "127.0.0.1", 0)
        self.relay = Relay("uav2", "uav1", self.server.sockets[0].getsockname())
        address, _, port = (await self.relay.start()).partition(":")
        self.address = (address, int(port))
        return self

    async def __aexit__(self, *_):
        self.relay.end()
        self.server.close()
        for writer in (*self.diallers, *self.listener.writers):
            writer.close()

    async def dial(self):
        reader, writer = await asyncio.open_connection(*self.address)
        self.diallers.append(writer)
        return reader, writer

    async def linked(self):
        """Dial, and wait until the listener knows."""
        known = len(self.listener.said)
        reader, writer = await self.dial()
        await until(lambda: len(self.listener.said) > known)
        return reader, writer, self.listener.writers[known]


async def settle():
    """Let the loop run, so that what can happen does."""
    for _ in range(ROUNDS):
        await asyncio.sleep(0)


def on_bench(test):
    """Run a test that is a coroutine function of a Bench."""

    def run():
        async def body():
            async with asyncio.timeout(2 * PATIENCE), Bench() as bench:
                await test(bench)

        asyncio.run(body())

    run.__name__ = test.__name__
    return run
