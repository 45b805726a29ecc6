"""A relay between real sockets on loopback."""

import asyncio
import contextlib
from collections import deque

import pytest
from flockwire_cli.relay.relay import MOST_CONNECTIONS, Relay
from flockwire_cli.relay.way import MOST_HELD

PATIENCE = 10.0  # s after which a test that waits has failed
LARGEST_READ = 262_144  # bytes that asyncio takes in at once
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
        reader, writer = await self.dial()
        known = len(self.listener.said)
        await until(lambda: len(self.listener.said) > known)
        return reader, writer, self.listener.writers[known]


async def until(met):
    """Let the loop run until something is so."""
    async with asyncio.timeout(PATIENCE):
        while not met():  # noqa: ASYNC110
            await asyncio.sleep(0.001)


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


@on_bench
async def test_bytes_pass_both_ways(bench):
    reader, writer, answer = await bench.linked()
    writer.write(b"there")
    await until(lambda: bench.listener.said == [b"there"])
    answer.write(b"and back")
    assert await reader.readexactly(8) == b"and back"


@on_bench
async def test_a_cut_takes_one_direction_and_what_it_held_arrives_after_the_mend(bench):
    reader, writer, answer = await bench.linked()
    bench.relay.there.cut()
    writer.write(b"late")
    await until(lambda: bench.relay.held == 4)
    answer.write(b"through")
    assert await reader.readexactly(7) == b"through"
    await settle()
    assert bench.listener.said == [b""]
    bench.relay.there.mend()
    await until(lambda: bench.listener.said == [b"late"])
    assert bench.relay.held == 0


@on_bench
async def test_a_delay_is_kept_in_its_direction_alone(bench):
    reader, writer, answer = await bench.linked()
    clock = asyncio.get_running_loop().time
    bench.relay.back.slow(0.2, 0.1)
    sent = clock()
    answer.write(b"slow")
    assert await reader.readexactly(4) == b"slow"
    assert 0.2 <= clock() - sent < PATIENCE
    answer.write(b"slow")
    await until(lambda: bench.relay.held == 4)
    writer.write(b"fast")
    await until(lambda: bench.listener.said == [b"fast"])
    assert bench.relay.held == 4
    assert await reader.readexactly(4) == b"slow"


@pytest.mark.parametrize("direction", ["there", "back"])
def test_a_new_connection_waits_for_the_mend_whichever_direction_is_cut(direction):
    @on_bench
    async def test(bench):
        way = getattr(bench.relay, direction)
        way.cut()
        _, writer = await bench.dial()
        writer.write(b"hello")
        await until(lambda: bench.relay.held == 5)
        await settle()
        assert bench.listener.said == []
        way.mend()
        await until(lambda: bench.listener.said == [b"hello"])

    test()


@on_bench
async def test_who_gave_up_while_the_link_was_cut_is_forgotten(bench):
    bench.relay.back.cut()
    _, writer = await bench.dial()
    writer.write(b"hello")
    await until(lambda: bench.relay.held == 5)
    writer.close()
    await until(lambda: bench.relay.connections == 0)
    bench.relay.back.mend()
    await bench.linked()
    assert bench.listener.said == [b""]


@on_bench
async def test_the_end_comes_after_what_was_said_before_it(bench):
    reader, _, answer = await bench.linked()
    bench.relay.back.cut()
    answer.write(b"bye")
    answer.close()
    await until(lambda: bench.relay.held == 3)
    bench.relay.back.mend()
    assert await reader.read() == b"bye"


@on_bench
async def test_one_direction_may_end_before_the_other(bench):
    reader, writer, answer = await bench.linked()
    writer.write(b"question")
    writer.write_eof()
    await until(lambda: bench.listener.ends == 1)
    assert bench.listener.said == [b"question"]
    answer.write(b"answer")
    answer.close()
    assert await reader.read() == b"answer"
    await until(lambda: bench.relay.connections == 0)


@on_bench
async def test_a_dialler_that_is_gone_gets_nothing_and_the_listener_learns_of_it(bench):
    _, writer, answer = await bench.linked()
    bench.relay.back.cut()
    answer.write(b"too late")
    await until(lambda: bench.relay.held == 8)
    writer.close()
    await until(lambda: bench.listener.ends == 1)
    answer.close()
    bench.relay.back.mend()
    await until(lambda: bench.relay.connections == 0)


@on_bench
async def test_what_a_cut_holds_is_bounded_and_all_of_it_arrives(bench):
    _, writer, _ = await bench.linked()
    bench.relay.there.cut()
    said = bytes(range(256)) * 40_000
    writer.write(said)
    await until(lambda: bench.relay.held >= MOST_HELD)
    await settle()
    assert bench.relay.held < MOST_HELD + LARGEST_READ
    bench.relay.there.mend()
    await until(lambda: bench.listener.said == [said])


@on_bench
async def test_a_receiver_that_does_not_read_makes_the_sender_wait(bench):
    reader, _, answer = await bench.linked()
    reader._transport.pause_reading()
    said = bytes(1_000_000) * 40
    answer.write(said)
    await until(lambda: bench.relay.held >= MOST_HELD)
    await settle()
    assert bench.relay.held < MOST_HELD + LARGEST_READ
    reader._transport.resume_reading()
    assert len(await reader.readexactly(len(said))) == len(said)


@on_bench
async def test_when_nobody_listens_the_dialler_is_turned_away(bench):
    bench.server.close()
    reader, _ = await bench.dial()
    with contextlib.suppress(ConnectionError):
        assert await reader.read() == b""
    await until(lambda: bench.relay.connections == 0)


@on_bench
async def test_connections_that_wait_are_few(bench):
    bench.relay.there.cut()
    waiting = deque()
    for k in range(MOST_CONNECTIONS + 1):
        waiting.append(await bench.dial())
        await until(lambda k=k: bench.relay.connections == min(k + 1, MOST_CONNECTIONS))
    with contextlib.suppress(ConnectionError):
        assert await waiting[0][0].read() == b""
    bench.relay.there.mend()
    await until(lambda: len(bench.listener.said) == MOST_CONNECTIONS)


@on_bench
async def test_at_its_end_everything_is_closed(bench):
    reader, writer, _ = await bench.linked()
    bench.relay.there.cut()
    writer.write(b"never")
    waiting, _ = await bench.dial()
    await until(lambda: bench.relay.held == 5 and bench.relay.connections == 2)
    bench.relay.end()
    for closed in (reader, waiting):
        with contextlib.suppress(ConnectionError):
            assert await closed.read() == b""
    await until(lambda: bench.listener.ends == 1 and bench.relay.connections == 0)
    assert bench.listener.said == [b""]
    with pytest.raises(ConnectionRefusedError):
        await bench.dial()
