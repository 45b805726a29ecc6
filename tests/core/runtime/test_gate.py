"""The gate in front of a port, on real sockets of this host."""

import socket
import sys
from pathlib import Path

import flockwire_core.runtime.gate
import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.gate import SHUT, Gate

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="filters at sockets are Linux's")

HERE, STRANGER, OTHER = "127.0.0.1", "127.0.0.2", "127.0.0.3"
MOST = 5  # pytest has more descriptors open


@pytest.fixture
def listener():
    with socket.create_server((HERE, 0), backlog=100) as server:
        yield server


@pytest.fixture
def linked():
    return []


@pytest.fixture
def gate(listener, linked):
    gate = Gate(listener.getsockname()[1], MOST, lambda: len(linked))
    yield gate
    gate.close()


@pytest.fixture
def dial(listener):
    dialled = []

    def dial(source, count=1):
        where = listener.getsockname()
        dialled.extend(socket.create_connection(where, timeout=0.3, source_address=(source, 0)) for _ in range(count))

    yield dial
    for one in dialled:
        one.close()


def test_who_has_many_connections_gets_no_more_and_others_do(gate, dial):
    dial(STRANGER, MOST + 1)
    dial(HERE, MOST)
    gate.look(0)
    assert not gate.shut
    gate.look(SECOND)
    assert gate.shut == {STRANGER: SECOND + SHUT}
    with pytest.raises(TimeoutError):
        dial(STRANGER)
    dial(HERE)


@pytest.mark.parametrize("more", [0, 1])
def test_it_holds_one_descriptor_and_none_without_a_listener(listener, more):
    folder = Path("/proc/self/fd")
    before = len(list(folder.iterdir()))
    gate = Gate(listener.getsockname()[1] + more, MOST, lambda: 0)
    assert len(list(folder.iterdir())) == before + 1 - more
    gate.close()
    assert len(list(folder.iterdir())) == before


def test_several_are_shut_out_and_stay_linked(gate, listener, dial):
    dial(STRANGER, MOST + 1)
    accepted = [listener.accept()[0] for _ in range(MOST + 1)]
    dial(OTHER, MOST + 1)
    gate.look(0)
    gate.look(SECOND)
    assert set(gate.shut) == {STRANGER, OTHER}
    for source in (STRANGER, OTHER):
        with pytest.raises(TimeoutError):
            dial(source)
    dial(HERE)
    for one in accepted:
        assert one.send(b"still linked")
        one.close()


def test_the_listener_s_accept_does_not_block(gate, listener):
    listener.setblocking(False)
    gate.look(0)
    with pytest.raises(BlockingIOError):
        listener.accept()


def test_connections_that_end_within_a_second_shut_nobody_out(gate, listener, dial):
    dial(STRANGER, MOST + 1)
    gate.look(0)
    for _ in range(MOST + 1):
        listener.accept()[0].close()
    gate.look(SECOND)
    dial(STRANGER, MOST + 1)
    gate.look(2 * SECOND)
    assert not gate.shut


def test_an_address_that_lets_go_is_heard_again(gate, listener, dial):
    dial(STRANGER, MOST + 1)
    gate.look(0)
    gate.look(SECOND)
    for _ in range(MOST + 1):
        listener.accept()[0].close()
    gate.look(SECOND + SHUT)
    assert not gate.shut
    dial(STRANGER)


def test_who_comes_again_is_shut_out_at_once_and_twice_as_long(gate, listener, dial):
    dial(STRANGER, MOST + 1)
    gate.look(0)
    now = SECOND
    for term in (SHUT, 2 * SHUT, 4 * SHUT):
        gate.look(now)
        assert gate.shut == {STRANGER: now + term}
        for _ in range(MOST + 1):
            listener.accept()[0].close()
        now += term
        gate.look(now)
        assert not gate.shut
        dial(STRANGER, MOST + 1)


def test_connections_that_were_left_before_they_were_accepted_count_more(gate, dial, listener):
    for _ in range(2):
        socket.create_connection(listener.getsockname(), source_address=(STRANGER, 0)).close()
    dial(OTHER, MOST)
    gate.look(0)
    gate.look(SECOND)
    assert gate.shut.keys() == {STRANGER}


def test_authenticated_connections_and_those_of_other_ports_do_not_count(gate, linked, dial):
    linked += [object()] * 3
    dial(HERE, MOST + 3)
    with socket.create_server((HERE, 0), backlog=100) as other:
        dialled = [socket.create_connection(other.getsockname(), source_address=(STRANGER, 0)) for _ in range(20)]
        gate.look(0)
        gate.look(SECOND)
        for one in dialled:
            one.close()
    assert not gate.shut


def test_where_the_kernel_may_not_be_asked_nobody_is_shut_out(gate, dial, monkeypatch, caplog):
    def forbidden(port):
        raise PermissionError(port)

    monkeypatch.setattr(flockwire_core.runtime.gate, "_connections", forbidden)
    dial(STRANGER, MOST + 1)
    gate.look(0)
    gate.look(SECOND)
    assert not gate.shut
    assert len(caplog.records) == 1
