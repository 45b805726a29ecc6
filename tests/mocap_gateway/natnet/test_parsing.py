"""Packets written down by hand from the protocol's documentation, without our encoder."""

from struct import pack

import pytest
from flockwire_mocap.natnet.packets import (
    MocapFrame,
    ModelDefinition,
    Other,
    Rejected,
    Response,
    ServerInfo,
)
from flockwire_mocap.natnet.parsing import parse
from flockwire_mocap.tracking import ReportedBody

# id 7, (1, 2, -0.5), quaternion (0, 0, 0, 1), error 0.25, parameters 1; and id 8, not tracked
BODY_7 = bytes.fromhex("07000000 0000803f 00000040 000000bf 00000000 00000000 00000000 0000803f 0000803e 0100")
BODY_8 = bytes.fromhex("08000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 0000")
BODIES = (
    ReportedBody(7, None, (1.0, 2.0, -0.5), (0.0, 0.0, 0.0, 1.0), tracked=True),
    ReportedBody(8, None, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), tracked=False),
)
MARKER = pack("<3f", 1, 2, 3)
MARKER_SETS = b"all\0" + pack("<i", 2) + MARKER * 2 + b"Drone 1\0" + pack("<i", 0)
SKELETON = pack("<ii", 1, 2) + BODY_7 * 2
ASSET = pack("<ii", 3, 1) + BODY_7 + pack("<i", 1) + pack("<i4fHf", 1, 1, 2, 3, 0.01, 0, 0)
LABELLED = pack("<i4fHf", 0x70001, 1, 2, 3, 0.012, 2, 0.0005)
CHANNELS = pack("<ii", 5, 2) + pack("<i2f", 2, 0.5, 0.5) + pack("<if", 1, 0.25)
SUFFIX = bytes.fromhex(
    "01000000 02000000"  # timecode, its subframe
    "00000000 00002940"  # 12.5 s
    "e8030000 00000000"  # mid-exposure 1000
    "dc050000 00000000"  # data received 1500
    "d0070000 00000000"  # transmitted 2000
)
PRECISION = bytes.fromhex("0a000000 14000000")
PARAMETERS, END = bytes.fromhex("0200"), bytes(4)
STAMPS = (12.5, 1000, 2000)


def packet(kind, body):
    return pack("<HH", kind, len(body)) + body


def section(count, data, counted):
    return pack("<i", count) + (pack("<I", len(data)) if counted else b"") + data


def frame(version, *, tail=END, more=(), precision=None):
    """A frame with every section in use."""
    counted = version >= (4, 1)
    sections = [(2, MARKER_SETS), (1, MARKER), (2, BODY_7 + BODY_8), (1, SKELETON)]
    sections += [(1, ASSET)] if counted else []
    sections += [(1, LABELLED), (1, CHANNELS), (1, CHANNELS), *more]
    data = pack("<i", 4242) + b"".join(section(*each, counted) for each in sections)
    precise = counted if precision is None else precision
    return packet(7, data + SUFFIX + (PRECISION if precise else b"") + PARAMETERS + tail)


@pytest.mark.parametrize("version", [(3, 0), (3, 1), (4, 0)])
def test_a_frame_without_byte_counts(version):
    assert parse(frame(version), version) == MocapFrame(4242, BODIES, *STAMPS, 2)


@pytest.mark.parametrize("version", [(4, 1), (4, 2), (4, 4)])
def test_a_frame_with_byte_counts(version):
    assert parse(frame(version), version) == MocapFrame(4242, BODIES, *STAMPS, 2)


@pytest.mark.parametrize("version", [(4, 5), (4, 6), (5, 0)])
@pytest.mark.parametrize("more", [[(0, b""), (0, b"")], [(2, bytes(90)), (1, bytes(3))], [(1, bytes(9))] * 5])
def test_sections_before_the_suffix_that_are_not_known_are_passed_over(version, more):
    assert parse(frame(version, more=more), version) == MocapFrame(4242, BODIES, *STAMPS, 2)


@pytest.mark.parametrize("version", [(3, 0), (4, 0), (4, 1), (4, 5)])
def test_the_end_marker_is_not_needed(version):
    assert parse(frame(version, tail=b""), version) == parse(frame(version), version)


def test_4_0_may_have_the_precision_words():
    assert parse(frame((4, 0), precision=True), (4, 0)) == MocapFrame(4242, BODIES, *STAMPS, 2)


def test_fields_that_a_later_version_appends_to_each_body_are_passed_over():
    longer = (BODY_7 + b"more") + (BODY_8 + b"more")
    parts = [(0, b""), (0, b""), (2, longer), *[(0, b"")] * 5]
    data = pack("<i", 1) + b"".join(section(*each, True) for each in parts)
    read = parse(packet(7, data + SUFFIX + PRECISION + PARAMETERS + END), (4, 2))
    assert read == MocapFrame(1, BODIES, *STAMPS, 2)


def test_bodies_that_do_not_share_their_section_evenly_are_rejected():
    parts = [(0, b""), (0, b""), (2, BODY_7 + BODY_8 + b"x"), *[(0, b"")] * 5]
    data = pack("<i", 1) + b"".join(section(*each, True) for each in parts)
    assert parse(packet(7, data + SUFFIX + PRECISION + PARAMETERS + END), (4, 2)) == Rejected(
        "2 rigid bodies in 77 bytes"
    )


@pytest.mark.parametrize("version", [(3, 0), (4, 0), (4, 1), (4, 5)])
def test_a_frame_cut_anywhere_is_rejected(version):
    whole = frame(version, tail=b"")
    for size in range(len(whole)):
        assert isinstance(parse(whole[:size], version), Rejected)
        body = whole[4:size]
        if body:
            assert isinstance(parse(packet(7, body), version), Rejected)


def test_frames_are_not_read_before_the_version_is_known():
    assert isinstance(parse(frame((3, 0)), None), Rejected)


def description(version, name=b"Drone 1\0", identity=7):
    turn = pack("<4f", 0, 0, 0, 1) if version >= (4, 2) else b""
    names = b"m1\0m2\0" if version >= (4, 0) else b""
    markers = pack("<i", 2) + MARKER * 2 + pack("<2i", 1, 2) + names
    return name + pack("<ii3f", identity, -1, 0, 0, 0) + turn + markers


def model(version, *, unknown=False):
    plate = pack("<i", 1) + b"SN1\0" + bytes(4 * (2 + 3 + 144 + 12)) + pack("<3i", 0, 0, 2) + b"Fx\0Fy\0"
    device = pack("<i", 1) + b"NIDAQ\0SN2\0" + pack("<3i", 0, 0, 1) + b"ch0\0"
    descriptions = [
        (0, b"all\0" + pack("<i", 2) + b"m1\0m2\0"),
        (1, description(version)),
        (2, b"Anna\0" + pack("<ii", 1, 1) + description(version, b"Hip\0", 1)),
        (3, plate),
        (4, device),
        (5, b"Prime 13 #1\0" + pack("<7f", 0, 2, 0, 0, 0, 0, 1)),
    ]
    if version >= (4, 1):
        bones = pack("<3i", 0, 9, 1) + description(version, b"Bone\0", 1)
        descriptions.append((6, b"Glove\0" + bones + pack("<i", 0)))
    if unknown:
        descriptions.append((77, b"?" * 21))
    descriptions.append((1, description(version, b"Person \xc3\xa4\0", 12)))
    counted = version >= (4, 1)
    data = b"".join(pack("<i", kind) + (pack("<I", len(d)) if counted else b"") + d for kind, d in descriptions)
    return packet(5, pack("<i", len(descriptions)) + data + END)


ALL_VERSIONS = [(3, 0), (3, 1), (4, 0), (4, 1), (4, 2), (4, 5)]


@pytest.mark.parametrize("version", ALL_VERSIONS)
def test_names_of_rigid_bodies_among_all_other_descriptions(version):
    assert parse(model(version), version) == ModelDefinition({7: "Drone 1", 12: "Person ä"}, complete=True)


@pytest.mark.parametrize("version", ALL_VERSIONS)
def test_a_description_that_is_not_known_ends_the_reading_only_where_no_byte_counts_are(version):
    read = parse(model(version, unknown=True), version)
    assert isinstance(read, ModelDefinition)
    assert read.complete == (version >= (4, 1))
    assert list(read.names.values()) == (["Drone 1", "Person ä"] if read.complete else ["Drone 1"])


def test_server_info():
    data = b"Motive".ljust(256, b"\0") + bytes([3, 1, 0, 2]) + bytes([4, 1, 0, 0])
    data += (10_000_000).to_bytes(8, "little") + bytes.fromhex("e705 01 efff2a63")
    info = ServerInfo("Motive", (3, 1, 0, 2), (4, 1, 0, 0), 10_000_000, 1511, True, "239.255.42.99")
    assert parse(packet(1, data), None) == info
    assert info.version == (4, 1)


def test_server_info_of_version_2_has_no_clock():
    data = b"Motive".ljust(256, b"\0") + bytes([1, 7, 0, 0]) + bytes([2, 9, 0, 0])
    assert parse(packet(1, data), None) == ServerInfo("Motive", (1, 7, 0, 0), (2, 9, 0, 0), 0, 0, False, "0.0.0.0")


def test_responses_and_what_is_not_for_us():
    assert parse(packet(3, bytes(4)), None) == Response(None, 0)
    assert parse(packet(3, b"Bitstream,4.1\0"), None) == Response("Bitstream,4.1", None)
    assert parse(packet(3, b"Bitstream,4.1"), None) == Response("Bitstream,4.1", None)
    assert parse(packet(100, b""), None) == Other(100)
    assert parse(packet(8, b"hello\0"), None) == Other(8)


@pytest.mark.parametrize("data", [b"", b"\x07", b"\x07\0\x01\0", b"\x01\0\x04\0abcd"])
def test_what_is_too_short_is_rejected(data):
    assert isinstance(parse(data, (4, 1)), Rejected)


def test_more_markers_than_there_are_bytes_are_refused_before_any_is_read():
    wrong = packet(7, pack("<iii", 4242, 0, 60_000) + bytes(60_000))
    assert parse(wrong, (3, 1)) == Rejected("60000 elements are announced, 60000 bytes are left")
