"""Either end of a VRPN connection, without a socket: bytes in, poses and bytes out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from flockwire_mocap.tracking import is_pose
from flockwire_mocap.vrpn.wire import (
    COOKIE,
    MAJOR,
    PING,
    PONG,
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
