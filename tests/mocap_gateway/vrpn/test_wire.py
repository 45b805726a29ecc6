"""Messages written down by hand from the protocol's documentation, without our encoder."""

from struct import pack

import pytest
from flockwire_mocap.vrpn.connection import (
    COOKIE,
    POSE,
    SENDER,
    TYPE,
    PoseBody,
    VrpnMessage,
    decode_name,
    decode_pose,
    encode,
    encode_description,
    encode_pose,
    take_message,
)
from hypothesis import given
from hypothesis import strategies as st

POSE_BODY = bytes.fromhex(
    "00000002 00000000"  # sensor 2, padding
    "3ff0000000000000 4000000000000000 bfe0000000000000"  # 1, 2, -0.5
    "0000000000000000 0000000000000000 0000000000000000 3ff0000000000000"
)
POSE_MESSAGE = bytes.fromhex("00000058 65000000 0007a120 00000001 00000000 00000000") + POSE_BODY
STAMP = 0x65000000 * 1_000_000_000 + 500_000_000
TRACKED = PoseBody(2, (1.0, 2.0, -0.5), (0.0, 0.0, 0.0, 1.0))


def test_the_cookie():
    assert COOKIE == b"vrpn: ver. 07.35  0\0\0\0\0\0"
    assert len(COOKIE) == 24


def test_a_pose():
    message, end = take_message(POSE_MESSAGE, 0)
    assert (message.stamp, message.sender, message.kind, end) == (STAMP, 1, 0, 88)
    assert decode_pose(message.body) == TRACKED
    assert encode(VrpnMessage(STAMP, 1, 0, encode_pose(TRACKED))) == POSE_MESSAGE


def test_a_description_is_padded_and_its_length_is_not():
    name = b"uav1\0"
    written = bytes.fromhex("00000021 00000000 00000000 00000003 ffffffff 00000000 00000005") + name + bytes(7)
    assert encode_description(SENDER, 3, "uav1") == written
    message, end = take_message(written, 0)
    assert (message.sender, message.kind, decode_name(message.body), end) == (3, SENDER, "uav1", 40)
    assert decode_name(take_message(encode_description(TYPE, 0, POSE), 0)[0].body) == POSE


@pytest.mark.parametrize("size", [0, 10, 23, 24, 87])
def test_a_message_that_has_not_all_come_is_waited_for(size):
    assert take_message(POSE_MESSAGE[:size], 0) == (None, 0)


@pytest.mark.parametrize("length", [0, 23, 1 << 17, 0xFFFFFFFF])
def test_a_length_that_cannot_be_ends_the_connection(length):
    with pytest.raises(ValueError, match=f"{length} bytes"):
        take_message(pack(">I", length) + POSE_MESSAGE[4:], 0)


@pytest.mark.parametrize("body", [b"", b"\0\0\0\0", b"\0\0\0\x09abc\0", b"\xff\xff\xff\xffabc\0"])
def test_a_description_without_a_name(body):
    assert decode_name(body) is None


def test_a_pose_that_is_too_short():
    assert decode_pose(POSE_BODY[:-1]) is None


@given(
    st.integers(0, 2**32 - 1), st.integers(0, 999_999), st.integers(-5, 5), st.integers(-5, 9), st.binary(max_size=100)
)
def test_messages_survive_the_wire(seconds, micros, sender, kind, body):
    message = VrpnMessage(seconds * 1_000_000_000 + micros * 1000, sender, kind, body)
    data = encode(message)
    assert len(data) % 8 == 0
    assert take_message(data, 0) == (message, len(data))
