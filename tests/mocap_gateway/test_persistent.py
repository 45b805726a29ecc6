"""A connection that is kept in spite of errors that nobody foresaw."""

import asyncio
import ctypes
import socket
import struct
import sys

import pytest
from flockwire_mocap import persistent
from flockwire_mocap.core import make_core
from flockwire_mocap.persistent import PersistentConnection
from flockwire_mocap.qualisys import QualisysClient
from flockwire_mocap.vrpn.client import VrpnClient
from flockwire_twins.trackers.qualisys import QtmServer
from flockwire_twins.trackers.vrpn import VrpnServer
from waiting import until


class Faulty(PersistentConnection):
    """Fails with each of the errors by turns, and is then lost as a connection usually is."""

    PAUSE = 0.001

    def __init__(self, errors):
        super().__init__(self, lambda: None)
        self.errors, self.reasons = errors, []

    failure = property(fset=lambda self, why: self.reasons.append(why))

    async def connected(self):
        if self.errors:
            raise self.errors.pop(0)
        return "the server has ended it"


@pytest.mark.parametrize("error", [ValueError("a line\ntoo long"), OSError(11, "no more processes"), KeyError("x")])
def test_an_unexpected_error_is_reported_and_does_not_end_the_attempts(error, caplog):
    async def run():
        client = Faulty([error, error])
        async with client:
            await until(lambda: client.reasons and client.reasons[-1] == "the server has ended it")
        return client.reasons

    reasons = asyncio.run(run())
    assert reasons[0] == f"the connection failed: {error!r}"
    assert len(reasons[0].splitlines()) == 1
    assert [record.exc_info[1] for record in caplog.records] == [error]  # once, however often


HOME = "127.0.0.1"
NAMES = ["uav1", "uav2"]
SO_ATTACH_FILTER = 26
NOTHING = struct.pack("=HBBI", 0x06, 0, 0, 0)  # a packet filter of one instruction: take no byte of it


def pull_cable(server):
    """Have the kernel drop whatever arrives at the server's only connection, probes too."""
    (client,) = server._clients
    program = ctypes.create_string_buffer(NOTHING)
    link = client.get_extra_info("socket")
    link.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, struct.pack("@HP", 1, ctypes.addressof(program)))


def vrpn(start, server):
    client = VrpnClient(
        make_core(start(source="vrpn", vrpn={"server": HOME, "port": server.port})).source, lambda: None
    )
    return client, lambda: not client.source.failure and len(client.source.connection.senders) == len(NAMES)


def qualisys(start, server):
    source = make_core(start(source="qualisys", qualisys={"port": server.port})).source
    return QualisysClient(source, lambda: None), lambda: "streams nothing" in source.failure


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="the cable is pulled by a filter of Linux's kernel")
@pytest.mark.parametrize(("kind", "connect"), [(VrpnServer, vrpn), (QtmServer, qualisys)])
def test_a_silent_server_keeps_its_connection_and_one_that_is_gone_gets_another(start, kind, connect, monkeypatch):
    monkeypatch.setattr(persistent, "SILENCE", 1)  # s
    monkeypatch.setattr(PersistentConnection, "PAUSE", 0.05)  # s

    async def run():
        server = kind(NAMES, port=0)
        await server.open()
        client, there = connect(start, server)
        async with client:
            await until(there)
            first = set(server._clients)
            await asyncio.sleep(2.5)  # longer than the kernel bears silence of the other end
            assert there()
            assert set(server._clients) == first
            pull_cable(server)
            await until(lambda: not there())
            await until(there)
            assert len(set(server._clients) - first) == 1
        server.close()

    asyncio.run(run())
