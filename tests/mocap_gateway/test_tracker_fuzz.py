"""Mutated packets through each tracker's parser: none may raise, and memory stays flat."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from random import Random
from struct import pack
from tracemalloc import get_traced_memory, start, stop

import pytest
from flockwire_core.swarm.gateway import NatNet
from flockwire_mocap.natnet.packets import (
    COUNTED,
    HEADER,
    NEWEST,
    RIGID_BODY,
    Kind,
    MocapFrame,
    ServerInfo,
    Version,
    encode,
    encode_command,
    encode_connect,
)
from flockwire_mocap.natnet.session import NatNetSession
from flockwire_mocap.tracking import ReportedBody
from flockwire_mocap.vrpn.connection import PoseBody, VrpnConnection, VrpnMessage
from flockwire_mocap.vrpn.connection import encode as encode_vrpn
from flockwire_mocap.vrpn.source import Reports
from flockwire_twins.trackers.natnet import NatNetTwin, announced, encode_frame, encode_model, encode_server_info

VERSIONS: tuple[Version, ...] = ((3, 0), (3, 1), (4, 0), (4, 1), (4, 2), (4, 5))
EXTREMES = (b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\0\x80", b"\0\0\0\0", b"\0\0\xc0\x7f", b"\x01\0\0\0")
SERVER, CLIENT = "10.0.0.1", ("10.0.0.2", 40000)
FRESH = 5000  # packets after which a session, and a connection, is made again

Step = Callable[[int], None]


def mutated(packet: bytes, corpus: list[bytes], dice: Random) -> bytes:
    """Return the packet with one to four changes: bytes, integers, cuts, repetitions, another packet's tail."""
    data = bytearray(packet)
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(data) + 1)
        match dice.randrange(6):
            case 0 if data:
                data[at % len(data)] = dice.randrange(256)
            case 1 if data:
                data[at % len(data)] ^= 1 << dice.randrange(8)
            case 2:
                data[at : at + 4] = dice.choice(EXTREMES)
            case 3:
                del data[at : at + dice.randrange(16)]
            case 4:
                data[at:at] = data[at : at + dice.randrange(16)]
            case _:
                data[at:] = dice.choice(corpus)[at:]
    return bytes(data)


def filled(
    frame: bytes, bodies: int, before: list[tuple[int, bytes]], behind: list[tuple[int, bytes]], version: Version
) -> bytes:
    """Return a frame with these sections (count, elements) in place of the empty ones round its rigid bodies."""
    empty = 8 if version >= COUNTED else 4
    begin = HEADER.size + 4 + 2 * empty
    end = begin + empty + bodies * RIGID_BODY.size

    def encoded(sections: list[tuple[int, bytes]]) -> bytes:
        return b"".join(pack("<II", n, len(data))[:empty] + data for n, data in sections)

    number, suffix = frame[HEADER.size : HEADER.size + 4], frame[end + len(behind) * empty :]
    return encode(Kind.FRAME, number + encoded(before) + frame[begin:end] + encoded(behind) + suffix)


def natnet_corpus(version: Version) -> list[bytes]:
    """Return one packet of each kind that a server of that version sends, each section of the frame in use."""
    bodies = tuple(ReportedBody(i, None, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), True) for i in range(4))
    body = pack("<i7ffH", 1, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1)
    channels = pack("<iiif", 1, 1, 1, 2.5)
    before = [(1, b"all\0" + pack("<i3f", 1, 1.0, 2.0, 3.0)), (1, pack("<3f", 1.0, 2.0, 3.0))]  # marker sets, others
    behind = [
        (1, pack("<ii", 1, 1) + body),  # skeletons
        *([(1, pack("<ii", 1, 1) + body + pack("<i", 0))] if version >= COUNTED else []),  # assets
        (1, pack("<i4fHf", 1, 1.0, 2.0, 3.0, 0.01, 0, 0.0)),  # labelled markers
        *[(1, channels)] * 2,  # force plates, devices
        *([(1, bytes(32)), (1, bytes(8))] if version >= NEWEST else []),  # IMU, GPIO
    ]
    info = ServerInfo("Motive", (*version, 0, 0), (*version, 0, 0), 10_000_000, 1511, True, "239.255.42.99")
    return [
        encode_server_info(info),
        encode_model({i: f"body{i}" for i in range(4)}, version),
        filled(
            encode_frame(MocapFrame(17, bodies, 12.5, 1000, 2000, 0), version), len(bodies), before, behind, version
        ),
        encode(Kind.RESPONSE, b"Bitstream,3.0\0"),
    ]


def natnet_client(dice: Random) -> Step:
    """Return a step of a client that a mad server talks to, in all versions by turns."""
    corpora = {version: natnet_corpus(version) for version in VERSIONS}
    state: list[NatNetSession] = []

    def step(count: int) -> None:
        corpus = corpora[VERSIONS[count // FRESH % len(VERSIONS)]]
        if count % FRESH == 0:
            state[:] = [NatNetSession(NatNet(server=SERVER, bitstream="3.0"))]
            state[0].receive(corpus[0], SERVER, 0)
        state[0].receive(mutated(dice.choice(corpus[1:] if count % 9 else corpus), corpus, dice), SERVER, count)

    return step


def natnet_server(dice: Random) -> Step:
    """Return a step of a server that a mad client talks to."""
    twin = NatNetTwin(announced((4, 5)), {1: "one", 2: "two"})
    plain = [encode(kind) for kind in (Kind.REQUEST_MODEL, Kind.KEEP_ALIVE, Kind.DISCONNECT)]
    corpus = [encode_connect(), encode_command("Bitstream,3.1"), encode_command("Bitstream"), *plain]

    def step(count: int) -> None:
        twin.receive(mutated(dice.choice(corpus), corpus, dice), CLIENT, count)

    return step


PING_NUMBER = 1  # the second type that a side describes


def vrpn(dice: Random) -> Step:
    """Return a step of a connection whose other side is mad."""
    source = VrpnConnection()
    greeting = source.outgoing()
    corpus = []
    for k in range(3):
        source.send_pose(f"body{k}", 1_700_000_000_000_000_000, PoseBody(0, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)))
        ping = encode_vrpn(VrpnMessage(0, source.describe(f"body{k}"), PING_NUMBER, b""))
        corpus.append(source.outgoing() + ping)
    state: list[tuple[VrpnConnection, Reports]] = []

    def step(count: int) -> None:
        if count % FRESH == 0 or state[0][0].failed is not None:
            state[:] = [(VrpnConnection(), state[0][1] if count % FRESH else Reports(Counter()))]
            state[0][0].receive(greeting)
        connection, reports = state[0]
        for pose in connection.receive(mutated(dice.choice(corpus), corpus, dice)):
            reports.frame(pose)
        connection.outgoing()

    return step


@pytest.mark.parametrize("packets", [5000, pytest.param(30_000, marks=pytest.mark.long)])
@pytest.mark.parametrize("make", [natnet_client, natnet_server, vrpn])
def test_mutated_packets_raise_nothing_and_leave_nothing(make: Callable[[Random], Step], packets: int) -> None:
    step = make(Random(7))
    start()
    try:
        for count in range(packets):
            if count == packets // 2:
                before, _ = get_traced_memory()
            step(count)
        assert get_traced_memory()[0] - before < 4 << 20
    finally:
        stop()
