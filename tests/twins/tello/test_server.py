"""A simulated Tello on real UDP, loopback only."""

import asyncio
import contextlib
import re
import socket

import pytest
from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_tello.client import CommandOutcome, TelloClient
from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.server import bound, serve

DRONE, CLIENT = "127.0.0.41", "127.0.0.42"
QUICK = {"takeoff_time": 1.6, "takeoff_height": 0.5}  # s, m

pytestmark = pytest.mark.integration


class Shell(asyncio.DatagramProtocol):
    """Passes datagrams to a function."""

    def __init__(self, take):
        self._take = take

    def datagram_received(self, data, addr):
        self._take(data, clock.monotonic())


async def talk(*commands):
    """Send a simulated Tello one command after the other; return what ended, and the client."""
    client, loop, here = TelloClient(), asyncio.get_running_loop(), asyncio.get_running_loop().create_future()
    states, _ = await loop.create_datagram_endpoint(lambda: Shell(client.receive_state), local_addr=(CLIENT, 0))
    port = states.get_extra_info("sockname")[1]
    server = asyncio.create_task(serve(TelloParameters(state_port=port, **QUICK), (DRONE, 0), 0, here.set_result))
    await asyncio.wait((here, server), return_when=asyncio.FIRST_COMPLETED)
    if server.done():
        server.result()  # raises why it could not begin
    replies, _ = await loop.create_datagram_endpoint(
        lambda: Shell(client.receive),
        local_addr=(CLIENT, 0),
        remote_addr=(DRONE, int(re.search(rf"at {DRONE}:(\d+),", await here)[1])),
    )
    ended = []
    try:
        until, waiting = clock.monotonic() + 20 * SECOND, list(commands)
        while len(ended) < len(commands) and clock.monotonic() < until:
            if waiting and len(ended) == len(commands) - len(waiting):
                client.send(waiting.pop(0), clock.monotonic())
            datagrams, finished = client.poll(clock.monotonic())
            for datagram in datagrams:
                replies.sendto(datagram)
            ended += finished
            await asyncio.sleep(0.01)
    finally:
        states.close()
        replies.close()
        server.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await server
    return ended, client


def test_a_client_flies_it_over_udp():
    ended, client = asyncio.run(talk("command", "sdk?", "takeoff", "tof?", "land"))
    assert [end.outcome for end in ended] == [CommandOutcome.DONE] * 5
    assert ended[1].reply == "20"
    assert 0.02 < ended[0].latency < 1.0
    assert 1.6 < ended[2].latency < 2.8
    assert client.state.h < 50
    assert client.malformed_states == 0


def test_two_cannot_have_one_address_but_a_client_can_share_the_port():
    with contextlib.closing(bound((DRONE, 0))) as first:
        address = first.getsockname()
        with pytest.raises(OSError, match="in use"):
            bound(address)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            client.bind(("127.0.0.43", address[1]))
            client.sendto(b"command", address)
            first.setblocking(True)
            first.settimeout(2.0)
            assert first.recvfrom(100) == (b"command", client.getsockname())
