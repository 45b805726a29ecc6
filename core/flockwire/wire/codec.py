"""The codec of all messages; no other file knows their layout.

The payloads are ROS 2 messages in CDR (schemas.py), so that a trace or a bridge needs no translation. Each starts with
its stamp, Unix ns (the time for which the content is valid), and the name of the world frame. The messages of the 100
Hz path are numbers from there on, one compiled struct each (stamped.py); the others hold texts and sequences.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, Protocol, TypeVar

from flockwire.domain.airframe import Command, FlightState, Telemetry
from flockwire.domain.bids import Bids
from flockwire.domain.body import Body, BodyKind, Nearby
from flockwire.domain.fields import from_fields
from flockwire.domain.motion import Estimate, LeaderMotion, Leading
from flockwire.domain.order import Mission, Stop
from flockwire.domain.pose import IdentityDoubt, Pose
from flockwire.domain.time import SECOND, TimeReply, TimeRequest
from flockwire.wire.batch import Batch, decode_batch, encode_batch
from flockwire.wire.cdr import HEADER, LONGEST_SEQUENCE, MessageError, Reader, Writer
from flockwire.wire.orders import read_bids, read_mission, write_bids, write_mission
from flockwire.wire.stamped import Kept, Layout, peek_length, unpack
from flockwire.wire.status import Status, read_status, write_status


class Message(Protocol):
    """The common part of all messages."""

    @property
    def stamp(self) -> int:
        """Unix time in ns for which the content is valid."""

    @property
    def frame(self) -> str:
        """The name of the world frame."""


M = TypeVar("M", bound=Message)
Fields = tuple[Any, ...]  # those of a message: as objects their numbers are packed as they are, unboxed by nobody
MOST_LAYOUTS = 256  # of messages of nearby bodies, that are kept
SMALLEST_BODY = 57  # least bytes of a nearby body


_POSE: Final = Layout("ddddddd")
_ESTIMATE: Final = Layout("dddddddddiIBB")
_COMMAND: Final = Layout("dddddd")
_NEARBY: Final[Kept[int, Layout]] = Kept(lambda count: Layout("I" + "Bddddddd" * count), MOST_LAYOUTS)
_KINDS: Final[dict[object, BodyKind]] = {int(kind): kind for kind in BodyKind}
_LEADING: Final[dict[object, Leading]] = {int(state): state for state in Leading}
_STATES: Final[dict[object, FlightState]] = {int(state): state for state in FlightState}


def _encode_pose(pose: Fields) -> bytes:
    stamp: int = pose[0]
    head, p, q = _POSE.heads[pose[1]], pose[2], pose[3]
    return head.pack(
        HEADER, stamp // SECOND, stamp % SECOND, head.length, head.raw, p[0], p[1], p[2], q[0], q[1], q[2], q[3]
    )


def _decode_pose(data: bytes) -> Pose:
    stamp, frame, v = unpack(data, _POSE)
    return from_fields(Pose, (stamp, frame, v[:3], v[3:]))


def _encode_estimate(estimate: Fields) -> bytes:
    stamp: int = estimate[0]
    motion: Fields = estimate[2]
    origin: int = estimate[3]
    head, p, v, a = _ESTIMATE.heads[estimate[1]], motion[0], motion[1], motion[2]
    return head.pack(
        HEADER, stamp // SECOND, stamp % SECOND, head.length, head.raw,
        p[0], p[1], p[2], v[0], v[1], v[2], a[0], a[1], a[2],
        origin // SECOND, origin % SECOND, estimate[4], estimate[5],
    )  # fmt: skip


def _decode_estimate(data: bytes) -> Estimate:
    stamp, frame, v = unpack(data, _ESTIMATE)
    leading = _LEADING.get(v[12])
    if leading is None or v[10] >= SECOND:
        raise MessageError(f"there is no state {v[12]} of a leader, or {v[10]} ns are more than a second")
    motion = from_fields(LeaderMotion, (v[:3], v[3:6], v[6:9]))
    return from_fields(Estimate, (stamp, frame, motion, v[9] * SECOND + v[10], v[11], leading))


def _encode_command(command: Fields) -> bytes:
    stamp: int = command[0]
    head, v = _COMMAND.heads[command[1]], command[2]
    return head.pack(
        HEADER, stamp // SECOND, stamp % SECOND, head.length, head.raw, v[0], v[1], v[2], 0.0, 0.0, command[3]
    )


def _decode_command(data: bytes) -> Command:
    stamp, frame, v = unpack(data, _COMMAND)
    return from_fields(Command, (stamp, frame, v[:3], v[5]))


def _encode_nearby(nearby: Nearby) -> bytes:
    stamp, frame, bodies = nearby
    values: list[object] = []
    for kind, relative_position, radius, velocity in bodies:
        values += (kind, *relative_position, radius, *velocity)
    head = _NEARBY[len(bodies)].heads[frame]
    if not bodies:
        return head.pack(HEADER, stamp // SECOND, stamp % SECOND, head.length, head.raw, 0)
    return head.pack(HEADER, stamp // SECOND, stamp % SECOND, head.length, head.raw, len(bodies), *values)


def _decode_nearby(data: bytes) -> Nearby:
    count = peek_length(data)
    if count > LONGEST_SEQUENCE or count * SMALLEST_BODY > len(data):
        raise MessageError(f"{count} nearby bodies in {len(data)} bytes; the most is {LONGEST_SEQUENCE}")
    stamp, frame, v = unpack(data, _NEARBY[count])
    if not count:
        return from_fields(Nearby, (stamp, frame, ()))
    if min(v[5::8]) < 0.0:
        raise MessageError(f"a nearby body of radius {min(v[5::8])}, below 0")
    bodies: list[Body] = []
    for k in range(1, 8 * count, 8):
        kind = _KINDS.get(v[k])
        if kind is None:
            raise MessageError(f"there is no body of kind {v[k]}")
        bodies.append(from_fields(Body, (kind, v[k + 1 : k + 4], v[k + 4], v[k + 5 : k + 8])))
    return from_fields(Nearby, (stamp, frame, tuple(bodies)))


def _telemetry(stamp: int, frame: str, v: tuple[Any, ...]) -> Telemetry:
    state = _STATES.get(v[0])
    if state is None:
        raise MessageError(f"there is no flight state {v[0]}")
    if v[4] not in (0, 1):
        raise MessageError(f"stop_received = {v[4]}: must be 0 or 1")
    return Telemetry(stamp, frame, state, v[1], v[2], v[3], bool(v[4]))


def _times(v: tuple[int, ...]) -> list[int]:
    """Return builtin_interfaces/Time values, each two numbers, in ns."""
    if max(v[1::2]) >= SECOND:
        raise MessageError(f"{max(v[1::2])} ns are more than a second")
    return [seconds * SECOND + rest for seconds, rest in zip(v[::2], v[1::2], strict=True)]


class Codec(NamedTuple):
    """The writer and the reader of one kind of message; the reader raises MessageError."""

    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Any]


def _numbers(
    body: str, numbers: Callable[[M], tuple[object, ...]], make: Callable[[int, str, tuple[Any, ...]], M]
) -> Codec:
    """Return the codec of a message that is not of the 100 Hz path: `numbers` are its, `body` their struct codes."""
    layout = Layout(body)

    def encode(message: M) -> bytes:
        head = layout.heads[message.frame]
        return head.pack(HEADER, *divmod(message.stamp, SECOND), head.length, head.raw, *numbers(message))

    return Codec(encode, lambda data: make(*unpack(data, layout)))


def _texts(write: Callable[[Writer, M], None], read: Callable[[int, str, Reader], M]) -> Codec:
    """Return the codec of a message with texts or sequences: `write` and `read` are of what follows the frame."""

    def encode(message: M) -> bytes:
        writer = Writer()
        writer.time(message.stamp)
        writer.text(message.frame)
        write(writer, message)
        return writer.finish()

    def decode(data: bytes) -> M:
        reader = Reader(data)
        message = read(reader.time(), reader.text(), reader)
        reader.end()
        return message

    return Codec(encode, decode)


CODECS: Final[dict[type[Any], Codec]] = {
    Pose: Codec(_encode_pose, _decode_pose),
    Estimate: Codec(_encode_estimate, _decode_estimate),
    Command: Codec(_encode_command, _decode_command),
    Nearby: Codec(_encode_nearby, _decode_nearby),
    Telemetry: _numbers("BdddB", lambda telemetry: telemetry[2:], _telemetry),
    IdentityDoubt: _numbers(
        "iI",
        lambda doubt: divmod(doubt.since, SECOND),
        lambda stamp, frame, v: IdentityDoubt(stamp, frame, *_times(v)),
    ),
    TimeRequest: _numbers("", lambda _: (), lambda stamp, frame, _: TimeRequest(stamp, frame)),
    TimeReply: _numbers(
        "iIiI",
        lambda reply: (*divmod(reply.requested, SECOND), *divmod(reply.received, SECOND)),
        lambda stamp, frame, v: TimeReply(stamp, frame, *_times(v)),
    ),
    Bids: _texts(write_bids, read_bids),
    Mission: _texts(write_mission, read_mission),
    Stop: _texts(
        lambda writer, stop: writer.text(stop.reason),
        lambda stamp, frame, reader: Stop(stamp, frame, reader.text()),
    ),
    Status: _texts(write_status, read_status),
    Batch: Codec(encode_batch, decode_batch),
}


def encode(message: Message) -> bytes:
    """Return the CDR bytes of `message`."""
    return CODECS[type(message)].encode(message)


def decode(kind: type[M], data: bytes) -> M:
    """Return the message of that kind in `data`; raises MessageError."""
    message: M = CODECS[kind].decode(data)
    return message
