"""Client and server over real sockets on loopback."""

import asyncio
import socket

from flockwire_core import clock
from flockwire_mocap.core import make_core
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_mocap.vrpn.client import VrpnClient
from flockwire_twins.trackers.vrpn import VrpnServer
from streaming import stream
from waiting import until

HOME = "127.0.0.1"
NAMES = [f"drone {k}" for k in range(10)]
FRAMES = 60


def frames(count=FRAMES):
    for number in range(count):
        now = clock.now() // 1000 * 1000
        places = enumerate(NAMES)
        bodies = (ReportedBody(k, n, (float(k), number / 3, 1.0), (0.0, 0.0, 0.0, 1.0), k != 4) for k, n in places)
        yield TrackerFrame(number, now, now, tuple(bodies))


def client_of(start, port, deliver=lambda frame, now, *_: None):
    source = make_core(start(source="vrpn", vrpn={"server": HOME, "port": port})).source
    source.arrived = deliver
    return VrpnClient(source, lambda: None)


def test_every_report_arrives_once_and_lost_bodies_say_nothing(start):
    async def fly():
        server, delivered = VrpnServer(NAMES, port=0), []
        await server.open()
        client = client_of(start, server.port, lambda frame, now, *_: delivered.append((frame, now)))
        async with client:
            await until(lambda: len(client.source.connection.senders) == len(NAMES))
            await stream(frames(), 240.0, server.publish)
            await until(lambda: len(delivered) == 9 * FRAMES)
        server.close()
        return client, delivered

    client, delivered = asyncio.run(fly())
    assert client.source.state(clock.now()) == ("", ())
    heights = {}
    for frame, now in delivered:
        (body,) = frame.bodies
        assert body.name == f"drone {int(body.position[0])}"
        assert 0 <= now - frame.captured < 500_000_000
        heights.setdefault(body.name, []).append(body.position[1])
    assert set(heights) == {name for name in NAMES if name != "drone 4"}
    assert all(seen == [number / 3 for number in range(FRAMES)] for seen in heights.values())


def test_a_server_that_comes_later_or_comes_back_is_found(start, monkeypatch):
    monkeypatch.setattr(VrpnClient, "PAUSE", 0.02)

    async def fly():
        first, delivered = VrpnServer(NAMES, port=0), []
        await first.open()
        port = first.port
        first.close()
        client = client_of(start, port, lambda frame, now, *_: delivered.append(frame))
        async with client:
            await until(lambda: "cannot be reached" in (client.source.failure))
            for _ in range(2):
                server = VrpnServer(NAMES, port=port)
                await server.open()
                await until(lambda: not client.source.failure and len(client.source.connection.senders) == len(NAMES))
                before = len(delivered)
                server.publish(next(frames()))
                await until(lambda before=before: len(delivered) == before + 9)
                server.close()
                await until(lambda: client.source.failure)
        return client, delivered

    client, delivered = asyncio.run(fly())
    assert "closed" in client.source.failure
    assert {frame.bodies[0].identity for frame in delivered} == set(range(9))  # the same numbers both times


def test_a_server_of_another_protocol_is_left(start):
    async def fly():
        def greet(reader, writer):
            writer.write(b"HTTP/1.1 400 Bad Request\r\n\r\n")

        server = await asyncio.start_server(greet, HOME, 0)
        client = client_of(start, server.sockets[0].getsockname()[1])
        async with client:
            await until(lambda: "not VRPN 7" in (client.source.failure))
        server.close()
        return client.source.failure

    assert "not VRPN 7" in asyncio.run(fly())


def test_a_client_that_asks_by_a_datagram_is_dialled(start):
    async def ask():
        server = VrpnServer(NAMES, port=0)
        await server.open()
        source = make_core(start(source="vrpn")).source
        lines = []

        async def accepted(reader, writer):
            writer.write(source.connection.outgoing())
            while len(source.connection.senders) < len(NAMES):
                source.read(await reader.read(4096), clock.now())
            server.publish(next(frames()))
            while not source.take(clock.now()):
                source.read(await reader.read(4096), clock.now())
            lines.append("a pose")
            writer.close()

        waiting = await asyncio.start_server(accepted, HOME, 0)
        port = waiting.sockets[0].getsockname()[1]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            for request in (b"", b"\xff", b"10.0.0.1", b"10.0.0.1 0", b"x 70000", f"10.0.0.1 {port}\0".encode()):
                client.sendto(request, (HOME, server.port))
            await until(lambda: lines)
        waiting.close()
        server.close()

    asyncio.run(ask())
