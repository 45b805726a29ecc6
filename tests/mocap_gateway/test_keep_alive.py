"""A tracker whose host loses its power, or its cable: the connection is given up, and made again when it is back."""

import asyncio
import ctypes
import socket
import struct
import sys

import pytest
from flockwire_mocap import keep_alive
from flockwire_mocap.core import make_core
from flockwire_mocap.persistent import PersistentConnection
from flockwire_mocap.qualisys.client import QualisysClient
from flockwire_mocap.qualisys.server import QtmServer
from flockwire_mocap.vrpn.client import VrpnClient
from flockwire_mocap.vrpn.server import VrpnServer
from waiting import until

HOME = "127.0.0.1"
NAMES = ["uav1", "uav2"]
SO_ATTACH_FILTER = 26
NOTHING = struct.pack("=HBBI", 0x06, 0, 0, 0)  # a packet filter of one instruction: take no byte of it


def pull_cable(server):
    """Have the kernel drop whatever arrives at the server's only connection, probes too."""
    (client,) = server._clients
    program = ctypes.create_string_buffer(NOTHING)
    link = client._transport.get_extra_info("socket")
    link.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, struct.pack("@HP", 1, ctypes.addressof(program)))


def vrpn(_, server):
    client = VrpnClient(HOME, lambda frame, now: None, server.port)
    return client, lambda: client.session.trouble is None and len(client.session.connection.senders) == len(NAMES)


def qualisys(start, server):
    source = make_core(start(source="qualisys", qualisys={"port": server.port})).source
    return QualisysClient(source, lambda: None), lambda: "streams nothing" in source.failure


@pytest.mark.skipif(sys.platform != "linux", reason="the cable is pulled by a filter of Linux's kernel")
@pytest.mark.parametrize(
    ("kind", "connect"), [(VrpnServer, vrpn), pytest.param(QtmServer, qualisys, marks=pytest.mark.long)]
)
def test_a_silent_server_keeps_its_connection_and_one_that_is_gone_gets_another(start, kind, connect, monkeypatch):
    monkeypatch.setattr(keep_alive, "SILENCE", 1)  # s
    monkeypatch.setattr(PersistentConnection, "PAUSE", 0.05)  # s

    async def run():
        server = kind(NAMES, port=0)
        await server.open()
        client, there = connect(start, server)
        client.open()
        await until(there)
        first = set(server._clients)
        await asyncio.sleep(2.5)  # longer than the kernel bears silence of the other end
        assert there()
        assert server._clients == first
        pull_cable(server)
        await until(lambda: not there())
        await until(there)
        assert len(server._clients - first) == 1
        await client.close()
        server.close()

    asyncio.run(run())
