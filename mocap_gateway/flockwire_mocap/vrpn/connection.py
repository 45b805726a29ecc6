"""Either end of a VRPN connection, without a socket: bytes in, poses and bytes out. All is big-endian.

A message is i32 length (header and body, without padding), i32 seconds, i32 microseconds, i32 sender, i32 type, padded
with NUL to 24 bytes, then the body, padded to a multiple of 8. Each side numbers senders and types anew on each
connection, and describes them before their first use.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from struct import Struct
from typing import NamedTuple

from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.time import MICROSECOND, SECOND
from flockwire_core.domain.vector import Vector

from flockwire_mocap.tracking import is_pose

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


MOST_NAMES = 2000  # senders, and types, that one side may describe; the reference implementation's limit


class PoseReport(NamedTuple):
    """A pose report: `name` of the sender, which is the body; stamp in ns of the server's Unix time."""

    name: str
    stamp: int
    pose: PoseBody


class VrpnConnection:
    """The state of a connection: the descriptions of both sides.

    Attributes:
        failed: why nothing more can be read, and the connection should be closed; None otherwise.
        senders: names by the other side's numbers.
        counts: of messages of a known type that could not be read, of those whose sender or type was never described,
            and of invalid poses: not finite, or not a unit quaternion.

    """

    def __init__(self, counts: Counter[str] | None = None) -> None:
        self.counts: Counter[str] = Counter() if counts is None else counts
        self.failed: str | None = None
        self.senders: dict[int, str] = {}
        self._types: dict[int, str] = {}
        self._own_senders: dict[str, int] = {}
        self._own_types: dict[str, int] = {}
        self._unread = bytearray()
        self._greeted = False
        self._outgoing = bytearray(COOKIE)
        for name in (POSE, PING, PONG):
            self._number(self._own_types, TYPE, name)

    def receive(self, data: bytes) -> list[PoseReport]:
        """Receive bytes, split anywhere; returns the completed poses, and answers pings."""
        if self.failed is not None:
            return []
        self._unread += data
        poses: list[PoseReport] = []
        try:
            for message in self._messages():
                pose = self._take_in(message)
                if pose is not None:
                    poses.append(pose)
        except ValueError as error:
            self.failed = str(error)
            self._unread.clear()
        return poses

    def outgoing(self) -> bytes:
        """Return the bytes that are to be sent since the last call."""
        data = bytes(self._outgoing)
        self._outgoing.clear()
        return data

    def describe(self, sender: str) -> int:
        """Return this side's number of the sender, described to the other side before its first use."""
        return self._number(self._own_senders, SENDER, sender)

    def send_pose(self, sender: str, stamp: int, pose: PoseBody) -> None:
        """Report a pose of the body `sender`; `stamp` in ns of Unix time."""
        self._send(stamp, sender, POSE, encode_pose(pose))

    def _send(self, stamp: int, sender: str, kind: str, body: bytes) -> None:
        number = self.describe(sender)  # its description is sent first
        self._outgoing += encode(VrpnMessage(stamp, number, self._own_types[kind], body))

    def _number(self, numbers: dict[str, int], kind: int, name: str) -> int:
        if name not in numbers:
            numbers[name] = len(numbers)
            self._outgoing += encode_description(kind, numbers[name], name)
        return numbers[name]

    def _messages(self) -> Iterator[VrpnMessage]:
        """Yield all received messages; raises ValueError if the bytes are not messages."""
        begin = 0
        if not self._greeted:
            if len(self._unread) < len(COOKIE):
                return
            if not self._unread.startswith(MAJOR):
                raise ValueError(f"not VRPN 7: {bytes(self._unread[:16])!r}")
            self._greeted, begin = True, len(COOKIE)
        try:
            while True:
                message, begin = take_message(self._unread, begin)
                if message is None:
                    return
                yield message
        finally:
            del self._unread[:begin]

    def _take_in(self, message: VrpnMessage) -> PoseReport | None:
        if message.kind < 0:
            if message.kind in {SENDER, TYPE}:
                self._described(message)
            return None
        kind, sender = self._types.get(message.kind), self.senders.get(message.sender)
        if kind is None or sender is None:
            self.counts["messages undescribed"] += 1
        elif kind == PING and (sender in self._own_senders or len(self._own_senders) < MOST_NAMES):
            self._send(message.stamp, sender, PONG, b"")
        elif kind == POSE:
            return self._pose(message, sender)
        return None

    def _described(self, message: VrpnMessage) -> None:
        names = self.senders if message.kind == SENDER else self._types
        name = decode_name(message.body)
        if name is None or (message.sender not in names and len(names) >= MOST_NAMES):
            self.counts["messages malformed"] += 1
        else:
            names[message.sender] = name

    def _pose(self, message: VrpnMessage, sender: str) -> PoseReport | None:
        pose = decode_pose(message.body)
        if pose is None:
            self.counts["messages malformed"] += 1
        elif not is_pose(pose.position, pose.orientation):
            self.counts["poses rejected"] += 1
        else:
            return PoseReport(sender, message.stamp, pose)
        return None
