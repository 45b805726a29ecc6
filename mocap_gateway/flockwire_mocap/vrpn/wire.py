"""VRPN's bytes: the cookie, the frame of a message, descriptions, poses. All is big-endian.

A message is i32 length (header and body, without padding), i32 seconds, i32 microseconds, i32 sender, i32 type, padded
with NUL to 24 bytes, then the body, padded to a multiple of 8. Each side numbers senders and types anew on each
connection, and describes them before their first use.
"""

from __future__ import annotations

from struct import Struct
from typing import NamedTuple

from flockwire_core.domain.quaternion import Quaternion
from flockwire_core.domain.time import MICROSECOND, SECOND
from flockwire_core.domain.vector import Vector

PORT = 3883
MAJOR = b"vrpn: ver. 07."
COOKIE = (MAJOR + b"35  0").ljust(24, b"\0")
SENDER, TYPE = -1, -2  # types of the messages that describe a sender and a type; other negative ones are not needed
POSE, PING, PONG = "vrpn_Tracker Pos_Quat", "vrpn_Base ping_message", "vrpn_Base pong_message"
HEADER_SIZE = 24

_HEADER = Struct(">IIIii4x")
_TEXT = Struct(">i")
_POSE = Struct(">ii7d")


class VrpnMessage(NamedTuple):
    """A message: `stamp` in ns of the sender's Unix time, `sender` and `kind` as numbered by the sending side."""

    stamp: int
    sender: int
    kind: int
    body: bytes


class PoseBody(NamedTuple):
    """The body of a pose message: m, quaternion x y z w."""

    sensor: int
    position: Vector
    orientation: Quaternion


def encode(message: VrpnMessage) -> bytes:
    """Return the bytes of a message."""
    seconds, rest = divmod(message.stamp, SECOND)
    length = HEADER_SIZE + len(message.body)
    head = _HEADER.pack(length, seconds & 0xFFFFFFFF, rest // MICROSECOND, message.sender, message.kind)
    return head + message.body + bytes(-length % 8)


def encode_description(kind: int, number: int, name: str) -> bytes:
    """Return the message that gives `number` to the sender or type (`kind` is SENDER or TYPE) of that name."""
    text = name.encode() + b"\0"
    return encode(VrpnMessage(0, number, kind, _TEXT.pack(len(text)) + text))


def encode_pose(pose: PoseBody) -> bytes:
    """Return the body of a pose message."""
    return _POSE.pack(pose.sensor, 0, *pose.position, *pose.orientation)


def decode_name(body: bytes) -> str | None:
    """Return the name in a description; None if there is none."""
    if len(body) < _TEXT.size or not 0 < _TEXT.unpack_from(body)[0] <= len(body) - _TEXT.size:
        return None
    return body[_TEXT.size :].partition(b"\0")[0].decode(errors="replace")


def decode_pose(body: bytes) -> PoseBody | None:
    """Return the pose in a message; None if there is none."""
    if len(body) < _POSE.size:
        return None
    sensor, _, x, y, z, qx, qy, qz, qw = _POSE.unpack_from(body)
    return PoseBody(sensor, (x, y, z), (qx, qy, qz, qw))


def take_message(data: bytes | bytearray, begin: int) -> tuple[VrpnMessage | None, int]:
    """Return the message at `begin` and the start of the next; None if it is incomplete.

    Raises:
        ValueError: there is no message, and the next one cannot be found.

    """
    if len(data) - begin < HEADER_SIZE:
        return None, begin
    length, seconds, micros, sender, kind = _HEADER.unpack_from(data, begin)
    if not HEADER_SIZE <= length <= 1 << 16:  # bytes of a message; a tracker's have under a hundred
        raise ValueError(f"a message of {length} bytes")
    end = begin + length + -length % 8
    if len(data) < end:
        return None, begin
    stamp = seconds * SECOND + micros * MICROSECOND
    return VrpnMessage(stamp, sender, kind, bytes(data[begin + HEADER_SIZE : begin + length])), end
