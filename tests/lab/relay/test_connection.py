"""A relay between real sockets on loopback: what it holds, delays, lets through and closes."""

import asyncio
import contextlib
from collections import deque

import pytest
from flockwire_lab.network import Conditions
from flockwire_lab.relay.relay import MOST_CONNECTIONS, MOST_HELD
from relay_bench import PATIENCE, on_bench, settle
from waiting import until

LARGEST_READ = 262_144  # bytes that asyncio takes in at once


@on_bench
async def test_bytes_pass_both_ways(bench):
    reader, writer, answer = await bench.linked()
    writer.write(b"there")
    await until(lambda: bench.listener.said == [b"there"])
    answer.write(b"and back")
    assert await reader.readexactly(8) == b"and back"


@on_bench
async def test_a_cut_takes_one_direction_and_what_it_held_arrives_after_it_is_restored(bench):
    reader, writer, answer = await bench.linked()
    bench.relay.there.disturb(None)
    writer.write(b"late")
    await until(lambda: bench.held == 4)
    answer.write(b"through")
    assert await reader.readexactly(7) == b"through"
    await settle()
    assert bench.listener.said == [b""]
    bench.relay.there.restore(None)
    await until(lambda: bench.listener.said == [b"late"])
    assert bench.held == 0


@on_bench
async def test_a_delay_is_kept_in_its_direction_alone(bench):
    reader, writer, answer = await bench.linked()
    clock = asyncio.get_running_loop().time
    bench.relay.back.disturb(Conditions(0.2, 0.1))
    sent = clock()
    answer.write(b"slow")
    assert await reader.readexactly(4) == b"slow"
    assert 0.2 <= clock() - sent < PATIENCE
    bench.relay.back.disturb(Conditions(60.0, 0.0))
    answer.write(b"slow")
    await until(lambda: bench.held == 4)
    writer.write(b"fast")
    await until(lambda: bench.listener.said == [b"fast"])
    assert bench.held == 4


@pytest.mark.parametrize("direction", ["there", "back"])
def test_a_new_connection_waits_until_it_is_restored_whichever_direction_is_cut(direction):
    @on_bench
    async def test(bench):
        cut = getattr(bench.relay, direction)
        cut.disturb(None)
        _, writer = await bench.dial()
        writer.write(b"hello")
        await until(lambda: bench.held == 5)
        await settle()
        assert bench.listener.said == []
        cut.restore(None)
        await until(lambda: bench.listener.said == [b"hello"])

    test()


@on_bench
async def test_who_gave_up_while_the_link_was_cut_is_forgotten(bench):
    bench.relay.back.disturb(None)
    _, writer = await bench.dial()
    writer.write(b"hello")
    await until(lambda: bench.held == 5)
    writer.close()
    await until(lambda: len(bench.relay.connections) == 0)
    bench.relay.back.restore(None)
    await bench.linked()
    assert bench.listener.said == [b""]


@on_bench
async def test_the_end_comes_after_what_was_said_before_it(bench):
    reader, _, answer = await bench.linked()
    bench.relay.back.disturb(None)
    answer.write(b"bye")
    answer.close()
    await until(lambda: bench.held == 3)
    bench.relay.back.restore(None)
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
    await until(lambda: len(bench.relay.connections) == 0)


@on_bench
async def test_a_dialler_that_is_gone_gets_nothing_and_the_listener_learns_of_it(bench):
    _, writer, answer = await bench.linked()
    bench.relay.back.disturb(None)
    answer.write(b"too late")
    await until(lambda: bench.held == 8)
    writer.close()
    await until(lambda: bench.listener.ends == 1)
    answer.close()
    bench.relay.back.restore(None)
    await until(lambda: len(bench.relay.connections) == 0)
    assert bench.held == 0


@on_bench
async def test_a_sender_to_a_dialler_that_is_gone_is_disconnected(bench):
    _, writer, answer = await bench.linked()
    writer.close()
    await until(lambda: bench.listener.ends == 1)

    def hung_up():
        answer.write(b"?")
        return len(bench.relay.connections) == 0

    await until(hung_up)
    assert bench.listener.said == [b""]


@on_bench
async def test_what_a_cut_holds_is_bounded_and_all_of_it_arrives(bench):
    _, writer, _ = await bench.linked()
    bench.relay.there.disturb(None)
    said = bytes(range(256)) * 40_000
    writer.write(said)
    await until(lambda: bench.held >= MOST_HELD)
    await settle()
    assert bench.held < MOST_HELD + LARGEST_READ
    bench.relay.there.restore(None)
    await until(lambda: bench.listener.said == [said])


@on_bench
async def test_a_receiver_that_does_not_read_makes_the_sender_wait(bench):
    reader, writer, answer = await bench.linked()
    writer.transport.pause_reading()
    said = bytes(1_000_000) * 40
    answer.write(said)
    await until(lambda: bench.held >= MOST_HELD)
    await settle()
    assert bench.held < MOST_HELD + LARGEST_READ
    writer.transport.resume_reading()
    assert len(await reader.readexactly(len(said))) == len(said)


@on_bench
async def test_when_no_process_listens_the_dialler_is_disconnected(bench):
    bench.server.close()
    reader, _ = await bench.dial()
    with contextlib.suppress(ConnectionError):
        assert await reader.read() == b""
    await until(lambda: len(bench.relay.connections) == 0)


@on_bench
async def test_connections_that_wait_are_few(bench):
    bench.relay.there.disturb(None)
    waiting = deque()
    for k in range(MOST_CONNECTIONS + 1):
        waiting.append(await bench.dial())
        await until(lambda k=k: len(bench.relay.connections) == min(k + 1, MOST_CONNECTIONS))
    with contextlib.suppress(ConnectionError):
        assert await waiting[0][0].read() == b""
    bench.relay.there.restore(None)
    await until(lambda: len(bench.listener.said) == MOST_CONNECTIONS)


@on_bench
async def test_at_its_end_everything_is_closed(bench):
    reader, writer, _ = await bench.linked()
    bench.relay.there.disturb(None)
    writer.write(b"never")
    waiting, _ = await bench.dial()
    await until(lambda: bench.held == 5 and len(bench.relay.connections) == 2)
    bench.relay.end()
    for closed in (reader, waiting):
        with contextlib.suppress(ConnectionError):
            assert await closed.read() == b""
    await until(lambda: bench.listener.ends == 1 and len(bench.relay.connections) == 0)
    assert bench.listener.said == [b""]
    with pytest.raises(ConnectionRefusedError):
        await bench.dial()


@on_bench
async def test_what_a_dialler_said_before_it_was_gone_arrives_though_it_is_answered(bench):
    _, writer, answer = await bench.linked()
    bench.relay.there.disturb(None)
    writer.write(b"bye")
    await until(lambda: bench.held == 3)
    writer.transport.abort()
    for _ in range(20):
        answer.write(b"?")
        await settle()
    assert bench.listener.ends == 0
    bench.relay.there.restore(None)
    await until(lambda: bench.listener.ends == 1)
    assert bench.listener.said == [b"bye"]
    await until(lambda: len(bench.relay.connections) == 0)


@on_bench
async def test_what_a_listener_said_before_it_was_gone_arrives_though_it_is_answered(bench):
    reader, writer, answer = await bench.linked()
    bench.relay.back.disturb(None)
    answer.write(b"bye")
    await until(lambda: bench.held == 3)
    answer.transport.abort()
    for _ in range(20):
        writer.write(b"?")
        await settle()
    assert len(bench.relay.connections) == 1
    bench.relay.back.restore(None)
    assert await reader.read() == b"bye"


@on_bench
async def test_at_its_end_bytes_that_nobody_takes_keep_no_connection_open(bench):
    _, writer, answer = await bench.linked()
    writer.transport.pause_reading()
    answer.write(bytes(1_000_000) * 40)
    await until(lambda: bench.held >= MOST_HELD)
    bench.relay.end()

    def hung_up():
        writer.write(b"?")
        return writer.transport.is_closing()

    await until(hung_up)


def test_bytes_that_nobody_takes_any_more_are_dropped_without_a_word(caplog):
    @on_bench
    async def test(bench):
        _, writer, answer = await bench.linked()
        bench.relay.back.disturb(None)
        for count in range(1, 11):
            answer.write(b"?")
            await until(lambda count=count: bench.held == count)
        writer.transport.abort()
        await until(lambda: bench.listener.ends == 1)
        bench.relay.back.restore(None)
        answer.close()
        await until(lambda: len(bench.relay.connections) == 0)

    test()
    assert [record.message for record in caplog.records] == []
