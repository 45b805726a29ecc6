from struct import pack

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_mocap.natnet.packets import (
    Kind,
    ModelDefinition,
    Other,
    Response,
    encode,
    encode_command,
    encode_connect,
    encode_model_request,
)
from flockwire_mocap.natnet.parsing import parse
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_twins.trackers.natnet import FREQUENCY, LIFETIME, NatNetTwin, announced

ALICE, BOB = ("10.0.0.2", 4000), ("10.0.0.3", 4000)
BODY = ReportedBody(7, None, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), tracked=True)
FRAME = TrackerFrame(5, SECOND, SECOND + 4_000_000, (BODY, BODY._replace(identity=8, tracked=False)))
NAMES = {7: "one", 8: "two"}


def test_unicast_serves_clients_that_connected_and_stay_alive():
    twin = NatNetTwin(announced((4, 1)), NAMES)
    assert twin.datagrams(FRAME, 0) == []
    twin.receive(encode_connect(), ALICE, 0)
    twin.receive(encode_connect(), BOB, 0)
    assert [to for _, to in twin.datagrams(FRAME, 1)] == [ALICE, BOB]
    twin.receive(encode(Kind.KEEP_ALIVE), BOB, LIFETIME - 1)
    assert [to for _, to in twin.datagrams(FRAME, LIFETIME)] == [BOB]
    twin.receive(encode(Kind.DISCONNECT), BOB, LIFETIME)
    assert twin.datagrams(FRAME, LIFETIME) == []


def test_multicast_serves_the_group():
    twin = NatNetTwin(announced((4, 1), multicast=True, data_port=9), NAMES)
    assert [to for _, to in twin.datagrams(FRAME, 0)] == [("239.255.42.99", 9)]


def test_each_client_gets_the_bitstream_that_it_asked_for():
    twin = NatNetTwin(announced((4, 1)), NAMES)
    twin.receive(encode_connect(), ALICE, 0)
    twin.receive(encode_connect(), BOB, 0)
    assert parse(twin.receive(encode_command("Bitstream,3.0"), BOB, 0), None) == Response(None, 0)
    assert parse(twin.receive(encode_command("Bitstream"), BOB, 0), None) == Response("Bitstream,3.0", None)
    (new, _), (old, _) = twin.datagrams(FRAME, 0)
    assert len(new) > len(old)
    assert parse(old, (3, 0)) == parse(new, (4, 1))


def long_greeting(*version):
    """A greeting as the vendor's later samples write it: 270 bytes with the version at 265, and a NUL."""
    body = bytearray(270)
    body[:4], body[265 : 265 + len(version)] = b"Ping", bytes(version)
    return encode(Kind.CONNECT, bytes(body) + b"\0")


@pytest.mark.parametrize(
    ("wanted", "own", "granted"),
    [
        ((4, 1), (4, 5), (4, 1)),
        ((3, 0), (4, 0), (3, 0)),
        ((4, 1), (3, 1), (3, 1)),
        ((4, 5), (4, 1), (4, 1)),
        ((), (4, 2), (4, 2)),
    ],
)
def test_a_greeting_may_ask_for_a_bitstream(wanted, own, granted):
    twin = NatNetTwin(announced(own), NAMES)
    assert parse(twin.receive(long_greeting(*wanted), ALICE, 0), None).version == granted
    assert len(parse(twin.datagrams(FRAME, 0)[0][0], granted).bodies) == 2


@pytest.mark.parametrize("wanted", ["Bitstream,4.5", "Bitstream,2.9", "Bitstream,x", "Bitstream,3", "Bitstream,3.0.0"])
def test_a_bitstream_that_it_cannot_speak_is_refused(wanted):
    twin = NatNetTwin(announced((4, 1)), NAMES)
    twin.receive(encode_connect(), ALICE, 0)
    assert parse(twin.receive(encode_command(wanted), ALICE, 0), None) == Response(None, 1)


@pytest.mark.parametrize("info", [announced((3, 1)), announced((4, 1), multicast=True)])
def test_old_servers_and_multicast_do_not_change_their_bitstream(info):
    twin = NatNetTwin(info, NAMES)
    twin.receive(encode_connect(), ALICE, 0)
    assert parse(twin.receive(encode_command("Bitstream,3.0"), ALICE, 0), None) == Response(None, 1)


def test_other_commands_are_not_recognized():
    twin = NatNetTwin(announced((4, 1)), NAMES)
    assert parse(twin.receive(encode_command("TimelinePlay"), ALICE, 0), None) == Other(Kind.UNRECOGNIZED)


def test_it_publishes_names_unless_it_is_one_that_does_not():
    told = parse(NatNetTwin(announced((4, 2)), NAMES).receive(encode(Kind.REQUEST_MODEL), ALICE, 0), (4, 2))
    assert told == ModelDefinition(NAMES, complete=True)
    silent = NatNetTwin(announced((4, 2)), {})
    assert silent.receive(encode(Kind.REQUEST_MODEL), ALICE, 0) is None


def test_lost_bodies_are_in_the_frame_and_marked():
    twin = NatNetTwin(announced((4, 1), multicast=True), NAMES)
    frame = parse(twin.datagrams(FRAME, 0)[0][0], (4, 1))
    assert [body.tracked for body in frame.bodies] == [True, False]
    assert (frame.mid_exposure, frame.transmitted) == (10_000_000, 10_040_000)


def test_frames_have_the_precision_stamp_from_4_0_on():
    sizes = {}
    for version in ((3, 1), (4, 0)):
        twin = NatNetTwin(announced(version), NAMES)
        twin.receive(encode_connect(), ALICE, 0)
        ((datagram, _),) = twin.datagrams(FRAME, 0)
        assert parse(datagram, version).bodies[0].identity == 7
        sizes[version] = len(datagram)
    assert sizes[4, 0] == sizes[3, 1] + 8


def test_an_echo_has_the_clients_number_and_the_clock_of_the_frames():
    twin, now = NatNetTwin(announced((4, 1)), NAMES), 500 * SECOND
    twin.datagrams(FRAME, now)
    answer = twin.receive(encode(Kind.ECHO, pack("<Q", 77)), ALICE, now + SECOND)
    ticks = (FRAME.transmitted + SECOND) * FREQUENCY // SECOND
    assert answer == encode(Kind.ECHOED, pack("<QQ", 77, ticks))
    assert twin.receive(encode(Kind.ECHO, b"short"), ALICE, now) is None


@pytest.mark.parametrize("masked", [False, True])
def test_names_are_sent_with_and_without_a_mask_of_types(masked):
    twin = NatNetTwin(announced((4, 1)), NAMES)
    model = parse(twin.receive(encode_model_request(masked), ALICE, 0), (4, 1))
    assert model.names == NAMES
