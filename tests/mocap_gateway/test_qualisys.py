"""QTM's protocol: the vendor's own client reads the twin, over real sockets."""

import asyncio
import socket
from math import cos, isnan, radians, sin, sqrt
from struct import pack, unpack_from

import pytest
import qtm_rt
from flockwire_mocap.core import make_core
from flockwire_mocap.qualisys import QualisysClient, from_columns, names_in
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_twins.trackers.qualisys import QtmServer, QtmTwin, encode_parameters, to_angles, to_columns
from hypothesis import given
from hypothesis import strategies as st
from waiting import until

HOME = "127.0.0.1"
NAMES = [f"uav{i}" for i in range(5)]
number = st.floats(-1.0, 1.0)


@given(st.tuples(number, number, number, number).filter(lambda q: sum(c * c for c in q) > 0.01))
def test_a_rotation_comes_back_from_its_matrix(q):
    length = sqrt(sum(c * c for c in q))
    unit = tuple(c / length for c in q)
    back = from_columns(to_columns(unit))
    same = sum(a * b for a, b in zip(unit, back, strict=True))
    assert abs(same) == pytest.approx(1.0, abs=1e-6)


def test_a_quarter_turn_is_columns_of_turned_axes():
    half = sqrt(0.5)
    assert to_columns((0.0, 0.0, half, half)) == pytest.approx((0, 1, 0, -1, 0, 0, 0, 0, 1))
    assert from_columns((0, 1, 0, -1, 0, 0, 0, 0, 1)) == pytest.approx((0.0, 0.0, half, half))


def frame(k):
    bodies = tuple(
        ReportedBody(i, n, (1000.0 * i, 10.0 * k, 1000.0), (0.0, 0.0, 0.6, 0.8), i != 4) for i, n in enumerate(NAMES)
    )
    return TrackerFrame(k, 10_000_000 * k, 10_000_000 * k, bodies)


def test_the_vendors_client_reads_the_twin():
    async def read():
        server, seen = QtmServer(NAMES, port=0), []
        await server.open()
        client = await qtm_rt.connect(HOME, port=server.port, timeout=2)
        names = names_in(await client.get_parameters(["6d"]))
        streaming = asyncio.ensure_future(client.stream_frames(components=["6d"], on_packet=seen.append))
        await asyncio.sleep(0.05)
        for k in range(5):
            server.publish(frame(k))
        assert await streaming == b"Ok"
        await until(lambda: len(seen) == 5)
        client.disconnect()
        server.close()
        return names, seen

    names, seen = asyncio.run(read())
    assert names == tuple(NAMES)
    assert [packet.framenumber for packet in seen] == list(range(5))
    _, bodies = seen[3].get_6d()
    assert tuple(bodies[2][0]) == (2000.0, 30.0, 1000.0)
    assert isnan(bodies[4][0].x)


def test_the_gateway_gets_poses_in_metres_and_lost_bodies_say_nothing(start):
    core, steps = None, []

    async def fly():
        nonlocal core
        server = QtmServer(NAMES, port=0)
        await server.open()
        core = make_core(start(source="qualisys", qualisys={"port": server.port}))
        client = QualisysClient(core.source, lambda: steps.append(core.source.complete()))
        async with client:
            await until(lambda: "streams nothing" in core.source.failure)
            await asyncio.sleep(0.05)
            for k in (1, 2, 4):
                server.publish(frame(k))
            await until(lambda: len(steps) == 3)
            found = core.source.take(0)
            server.close()
            await until(lambda: "closed the connection" in core.source.failure)
        return found

    (found,) = asyncio.run(fly())
    assert [body.name for body in found.bodies if body.tracked] == NAMES[:4]
    assert found.bodies[2].position == pytest.approx((2.0, 0.04, 1.0))
    assert found.bodies[2].orientation == pytest.approx((0.0, 0.0, 0.6, 0.8), abs=1e-6)
    assert core.source.state(0).counts == (("frames missing", 1),)


@pytest.mark.parametrize("serve", [True, False])
def test_a_server_of_another_kind_or_none_is_a_line_with_a_remedy(start, serve, monkeypatch):
    monkeypatch.setattr("flockwire_mocap.qualisys.ANSWER_TIMEOUT", 0.3)

    async def wait():
        other = await asyncio.start_server(lambda reader, writer: None, HOME, 0)
        port = other.sockets[0].getsockname()[1]
        if not serve:
            other.close()
        source = make_core(start(source="qualisys", qualisys={"port": port})).source
        client = QualisysClient(source, lambda: None)
        async with client:
            await until(lambda: not source.failure.startswith("waits"))
        other.close()
        return source.failure

    assert ("does not answer like QTM" if serve else "check address, port") in asyncio.run(wait())


def test_settings_without_bodies_and_hostile_ones_are_lines():
    with pytest.raises(ValueError, match="no rigid bodies"):
        names_in(b"<QTM><The_6D><Bodies>0</Bodies></The_6D></QTM>")
    with pytest.raises(ValueError, match="not XML"):
        names_in(b"<QTM>")
    with pytest.raises(ValueError, match="not plain XML"):
        names_in(b'<!DOCTYPE x [<!ENTITY a "b">]><x/>')


def command(text):
    """Return a client's command."""
    return pack("<II", 9 + len(text.encode()), 1) + text.encode() + b"\0"


def twin_and_datagrams():
    sent = []
    twin = QtmTwin(NAMES, lambda data, port: sent.append((data, port)))
    twin.outgoing()
    return twin, sent


@given(st.tuples(number, number, number, number).filter(lambda q: sum(c * c for c in q) > 0.01))
def test_angles_are_turns_about_x_then_the_new_y_then_the_new_z(q):
    length = sqrt(sum(c * c for c in q))
    columns = to_columns(tuple(c / length for c in q))
    (sa, sb, sc), (ca, cb, cc) = zip(*((sin(radians(w)), cos(radians(w))) for w in to_angles(columns)), strict=True)
    product = (
        cb * cc, ca * sc + sa * sb * cc, sa * sc - ca * sb * cc,
        -cb * sc, ca * cc - sa * sb * sc, sa * cc + ca * sb * sc,
        sb, -sa * cb, ca * cb,
    )  # fmt: skip
    assert product == pytest.approx(columns, abs=1e-6)


def test_a_turn_about_one_axis_is_one_angle():
    for axis in range(3):
        turn = tuple(0.5 if k == axis else 0.0 for k in range(3))
        expected = tuple(60.0 if k == axis else 0.0 for k in range(3))
        assert to_angles(to_columns((*turn, sqrt(0.75)))) == pytest.approx(expected, abs=1e-6)


def test_an_old_client_gets_angles_by_datagrams():
    async def read():
        server = QtmServer(NAMES, port=0)
        await server.open()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
            receiver.bind((HOME, 0))
            receiver.setblocking(False)
            reader, writer = await asyncio.open_connection(HOME, server.port)
            port = receiver.getsockname()[1]
            for text in ("Version 1.19", "GetParameters 6D", f"StreamFrames AllFrames UDP:{port} 3DNoLabels 6DEuler"):
                writer.write(command(text))
            said = b""
            while b"</QTM_Parameters_Ver_1.19>" not in said:
                said += await reader.read(4096)
            await until(lambda: next(iter(server._clients.values()))._components)
            server.publish(frame(3))
            async with asyncio.timeout(3.0):
                datagram = await asyncio.get_running_loop().sock_recv(receiver, 65535)
            writer.close()
            server.close()
        return said, datagram

    said, datagram = asyncio.run(read())
    assert b"Version set to 1.19" in said
    size, kind, microseconds, number, components = unpack_from("<IIqII", datagram)
    assert (size, kind, microseconds, number, components) == (len(datagram), 3, 30_000, 3, 2)
    assert unpack_from("<III", datagram, 24) == (16, 2, 0)  # no loose markers
    assert unpack_from("<III", datagram, 40) == (16 + 5 * 24, 6, 5)
    bodies = [unpack_from("<6f", datagram, 56 + 24 * k) for k in range(5)]
    assert bodies[2] == pytest.approx((2000.0, 30.0, 1000.0, 0.0, 0.0, 73.7398), abs=1e-3)
    assert all(map(isnan, bodies[4]))


def test_a_client_may_stop_and_continue_over_tcp():
    twin, sent = twin_and_datagrams()
    for text, over_tcp, datagrams in (
        ("StreamFrames AllFrames UDP:5000 6D", False, 1),
        ("StreamFrames Stop", False, 1),
        ("StreamFrames Frequency:100 6D 6DEuler", True, 1),
    ):
        twin.receive(command(text))
        assert twin.outgoing() == b""
        twin.publish(frame(1))
        assert (bool(twin.outgoing()), len(sent)) == (over_tcp, datagrams)
    assert sent[0][1] == 5000


@pytest.mark.parametrize(
    "arguments",
    ["", "AllFrames", "6D Skeleton", "UDP:0 6D", "UDP:65536 6D", "UDP:x 6D", "UDP: 6D", "UDP:1 UDP:2 6D", "UDP:5000",
     "UDP:10.0.0.1:5000 6D", "UDP:² 6D"],
)  # fmt: skip
def test_what_is_not_served_is_an_error_and_ends_what_was(arguments):
    twin, sent = twin_and_datagrams()
    twin.receive(command("StreamFrames AllFrames UDP:5000 6D"))
    twin.receive(command(f"StreamFrames {arguments}"))
    assert b"Parse error" in twin.outgoing()
    twin.publish(frame(1))
    assert (twin.outgoing(), sent) == (b"", [])


@given(st.binary(max_size=64))
def test_whatever_a_client_sends_the_twin_answers_or_leaves(data):
    twin = QtmTwin(NAMES, lambda data, port: None)
    twin.receive(data)
    assert twin.outgoing()


def test_names_follow_the_settings_and_until_then_no_body_has_one(start, monkeypatch):
    monkeypatch.setattr("flockwire_mocap.qualisys.NAMES_PERIOD", 0.05)
    monkeypatch.setattr("flockwire_mocap.qualisys.NAMES_PAUSE", 0.05)

    async def fly():
        server = QtmServer(NAMES, port=0)
        await server.open()
        source = make_core(start(source="qualisys", qualisys={"port": server.port})).source
        client = QualisysClient(source, lambda: None)
        async with client:
            numbers = iter(range(1, 10_000))

            def seen(bodies=5):
                sent = frame(next(numbers))
                server.publish(sent._replace(bodies=sent.bodies[:bodies]))
                return [body.name for one in source.take(0) for body in one.bodies]

            await until(lambda: source.names and seen() == NAMES)
            (conversation,) = server._clients.values()
            conversation._names = ("uav1", "uav0", *NAMES[2:])  # exchanged in QTM's project
            await until(lambda: seen() == [*conversation._names])
            answers, conversation._names = conversation._answer, tuple(NAMES[1:])
            conversation._answer = lambda _: b""  # slow
            await until(lambda: seen(4) == [None] * 4)
            conversation._answer = answers
            conversation._outgoing += encode_parameters(conversation._names, "1.25")
            await until(lambda: seen(4) == NAMES[1:])
        server.close()

    asyncio.run(fly())


def test_bodies_that_are_not_enabled_have_no_place_in_frames_without_them():
    body = "<Body><Name>{}</Name><Enabled>{}</Enabled></Body>"
    settings = "".join(body.format(name, name != "b") for name in "abc")
    xml = f"<QTM><The_6D>{settings}</The_6D></QTM>".encode()
    assert (names_in(xml), names_in(xml, 3), names_in(xml, 2)) == (("a", "b", "c"), ("a", "b", "c"), ("a", "c"))
