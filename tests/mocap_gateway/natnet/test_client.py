"""Client and server over real sockets on loopback."""

import asyncio
import socket
from types import SimpleNamespace

import pytest
from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.gateway import NatNet
from flockwire_mocap.natnet.client import NatNetClient
from flockwire_mocap.natnet.packets import DATA_PORT, GROUP, HEADER, Kind
from flockwire_mocap.natnet.session import NatNetSession
from flockwire_mocap.natnet.source import trouble
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_twins.trackers.natnet import announced
from flockwire_twins.trackers.natnet_server import NatNetServer
from streaming import stream
from waiting import SOON, until

HOME = "127.0.0.1"
NAMES = {k: f"drone {k}" for k in range(1, 11)}
VERSIONS = [(3, 0), (3, 1), (4, 0), (4, 1), (4, 2), (4, 5)]
FRAMES = 60


def frames(count=FRAMES):
    for number in range(count):
        now = clock.now()
        bodies = (ReportedBody(k, None, (float(k), number / 4, 1.0), (0.0, 0.0, 0.0, 1.0), tracked=True) for k in NAMES)
        yield TrackerFrame(number, now - 8_000_000, now, tuple(bodies))


def session_of(command_port, **table):
    return NatNetSession(NatNet(server=HOME, interface=HOME, command_port=command_port, **table))


def client_of(session, arrived=lambda frame, now: None):
    return NatNetClient(SimpleNamespace(session=session, arrived=arrived), lambda: None)


async def fly(info, multicast, ready=lambda session: session.names == NAMES, names=NAMES, **options):
    """Stream frames to a client; returns them, its session, and the frames as they were delivered."""
    server = NatNetServer(info._replace(data_port=0), names, command_port=0)
    await server.open()
    session, delivered = session_of(server.command_port, multicast=multicast, **options), []
    try:
        async with client_of(session, lambda frame, now: delivered.append((frame, now))):
            await until(lambda: ready(session))
            if multicast:
                await asyncio.sleep(0.15)  # the group that the server has announced is joined at the client's next tick
            await stream(frames(), 240.0, server.publish)
            await until(lambda: len(delivered) == FRAMES)
    finally:
        server.close()
    return session, delivered


@pytest.mark.parametrize("multicast", [False, True], ids=["unicast", "multicast"])
@pytest.mark.parametrize("version", VERSIONS)
def test_every_frame_arrives_once_with_names(version, multicast):
    session, delivered = asyncio.run(fly(announced(version, multicast), multicast))
    assert [frame.number for frame, _ in delivered] == list(range(FRAMES))
    assert not any(session.counts.values())
    for frame, now in delivered:
        assert {body.identity: body.name for body in frame.bodies} == NAMES
        assert all(body.position == (float(body.identity), frame.number / 4, 1.0) for body in frame.bodies)
        assert frame.transmitted - frame.captured == 8_000_000
        assert 0 <= now - frame.transmitted < 500_000_000
    assert trouble(session, delivered[-1][1]) is None


def test_frames_come_by_number_from_a_server_that_publishes_no_names():
    info = announced((4, 1))
    session, delivered = asyncio.run(fly(info, False, lambda session: session.info is not None, names={}))
    assert [body.identity for body in delivered[-1][0].bodies] == list(NAMES)
    assert session.names == {}


def test_an_older_bitstream_over_the_wire():
    def ready(session):
        return session.adjusted and session.names == NAMES

    session, delivered = asyncio.run(fly(announced((4, 5)), False, ready, bitstream="3.0"))
    assert session.version == (3, 0)
    assert len(delivered) == FRAMES


def test_a_server_that_never_answers_is_read_in_the_version_that_is_set():
    async def listen():
        server = NatNetServer(announced((4, 2), multicast=True, data_port=0), NAMES, command_port=0)
        await server.open()
        session, delivered = session_of(9, multicast=True, bitstream="4.2", group=GROUP, data_port=server.data_port), []
        async with client_of(session, lambda frame, now: delivered.append(frame)):
            await stream(frames(5), 240.0, server.publish)
            await until(lambda: len(delivered) == 5)
        server.close()
        return session

    session = asyncio.run(listen())
    assert (session.info, session.names) == (None, {})


def test_a_server_that_is_not_there_is_a_line_and_no_hang():
    async def wait():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind((HOME, 0))
            taken.setblocking(False)
            session = session_of(port := taken.getsockname()[1])
            async with client_of(session):
                greeting = await asyncio.wait_for(asyncio.get_running_loop().sock_recv(taken, 1000), SOON)
            return HEADER.unpack_from(greeting)[0], trouble(session, clock.now()), port

    kind, found, port = asyncio.run(wait())
    assert kind == Kind.CONNECT
    assert found.startswith(f"no answer from 127.0.0.1:{port}")


def test_a_stranger_on_the_same_host_is_not_the_server():
    async def intrude():
        client = client_of(session := session_of(9))
        async with client:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
                stranger.bind(("127.0.0.2", 0))
                stranger.sendto(b"\x07\0\0\0", client._sockets[0].getsockname())
            await until(lambda: session.counts["packets of others"] == 1)
        return session

    assert asyncio.run(intrude()).foreign == "127.0.0.2"


@pytest.mark.parametrize(("multicast", "shared"), [(True, True), (False, False)], ids=["multicast", "unicast"])
def test_a_client_of_the_group_on_the_servers_host_shares_its_port(multicast, shared):
    async def listen():
        server = NatNetServer(announced((4, 1), multicast=multicast, data_port=0), NAMES, command_port=0)
        await server.open()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                client.bind(("", server.data_port))
            except OSError:
                return False
            finally:
                server.close()
        return True

    assert asyncio.run(listen()) == shared


@pytest.mark.parametrize("bitstream", [None, "4.1"])
def test_a_group_that_the_server_has_not_announced_is_left(bitstream):
    async def eavesdrop():
        server = NatNetServer(announced((4, 1), multicast=True, data_port=0), NAMES, command_port=0)
        other = NatNetServer(announced((4, 1), multicast=True, data_port=DATA_PORT), NAMES, command_port=0)
        await server.open()
        await other.open()
        session, delivered = session_of(server.command_port, multicast=True, bitstream=bitstream), []
        async with client_of(session, lambda frame, now: delivered.append(frame)):
            await until(lambda: session.names == NAMES)
            await asyncio.sleep(0.15)
            for frame in frames(5):
                other.publish(frame._replace(number=frame.number + 100))
                server.publish(frame)
            await until(lambda: len(delivered) == 5)
        server.close()
        other.close()
        return session, delivered

    session, delivered = asyncio.run(eavesdrop())
    assert [frame.number for frame in delivered] == list(range(5))
    assert session.frames == 5


def test_the_group_is_joined_again_when_frames_stay_away(monkeypatch):
    monkeypatch.setattr("flockwire_mocap.natnet.client.SILENCE", SECOND // 5)

    async def replug():
        server = NatNetServer(announced((4, 1), multicast=True, data_port=0), NAMES, command_port=0)
        await server.open()
        session = session_of(server.command_port, multicast=True)
        client = client_of(session)
        endless = frames(100_000)

        def arrives():
            server.publish(next(endless))
            return clock.now() - session.framed_at < SECOND // 10

        async with client:
            await until(arrives)
            client._sockets[-1].setsockopt(  # what a network adapter that is unplugged does to its groups
                socket.IPPROTO_IP, socket.IP_DROP_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton(HOME)
            )
            await until(lambda: not arrives())
            await until(arrives)
            assert len(client._sockets) == 2
        server.close()

    asyncio.run(replug())
