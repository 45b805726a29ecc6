"""The codec of all messages; no other file knows their layout.

The payloads are ROS 2 messages in CDR (schemas.py), so that a trace or a bridge needs no translation. Each starts with
its stamp, Unix ns (the time for which the content is valid), and the name of the world frame. The messages of the 100
Hz path are numbers at known places from there on (stamped.py); the others are written and read value by value (cdr.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, Protocol, TypeVar

from librt.strings import read_f64_le, read_i32_le, write_f64_le, write_i32_le

from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.bids import Bids
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.signals import Signals
from flockwire_core.domain.time import SECOND, TimeReply, TimeRequest
from flockwire_core.wire.batch import Batch, decode_batch, encode_batch
from flockwire_core.wire.cdr import LONGEST_SEQUENCE, MessageError, Reader, Writer, align, too_short
from flockwire_core.wire.orders import read_bids, read_mission, write_bids, write_mission
from flockwire_core.wire.stamped import (
    RECENT,
    begin,
    check_end,
    check_finite,
    last_numbers,
    read_head,
    read_vector,
    write_vector,
)
from flockwire_core.wire.status import Status
from flockwire_core.wire.status_codec import read_status, write_status


class Message(Protocol):
    """The common part of all messages."""

    @property
    def stamp(self) -> int:
        """Unix time in ns for which the content is valid."""

    @property
    def frame(self) -> str:
        """The name of the world frame."""


M = TypeVar("M", bound=Message)
SMALLEST_BODY: Final = 57  # least bytes of a nearby body


_KINDS: Final[dict[int, BodyKind]] = {int(kind): kind for kind in BodyKind}
_LEADING: Final[dict[int, Leading]] = {int(state): state for state in Leading}
_STATES: Final[dict[int, FlightState]] = {int(state): state for state in FlightState}


def _encode_pose(pose: Pose) -> bytes:
    writer, q = begin(pose.stamp, pose.frame), pose.orientation
    write_vector(writer, pose.position)
    write_vector(writer, (q[0], q[1], q[2]))
    write_f64_le(writer, q[3])
    return writer.getvalue()


def _decode_pose(data: bytes) -> Pose:
    stamp, frame, at = read_head(data)
    at = last_numbers(data, at, 56)
    p, q, w = read_vector(data, at), read_vector(data, at + 24), read_f64_le(data, at + 48)
    check_finite(p[0] + p[1] + p[2] + q[0] + q[1] + q[2] + w)
    return Pose(stamp, frame, p, (q[0], q[1], q[2], w))


def _encode_estimate(estimate: Estimate) -> bytes:
    writer, motion = begin(estimate.stamp, estimate.frame), estimate.motion
    write_vector(writer, motion.position)
    write_vector(writer, motion.velocity)
    write_vector(writer, motion.acceleration)
    write_i32_le(writer, estimate.origin // SECOND)
    write_i32_le(writer, estimate.origin % SECOND)
    writer.append(estimate.hops)
    writer.append(int(estimate.leading))
    return writer.getvalue()


def _decode_estimate(data: bytes) -> Estimate:
    stamp, frame, at = read_head(data)
    at = last_numbers(data, at, 82)
    p, v, a = read_vector(data, at), read_vector(data, at + 24), read_vector(data, at + 48)
    check_finite(p[0] + p[1] + p[2] + v[0] + v[1] + v[2] + a[0] + a[1] + a[2])
    seconds: int = read_i32_le(data, at + 72)
    rest: int = read_i32_le(data, at + 76)
    leading = _LEADING.get(data[at + 81])
    if leading is None or not 0 <= rest < SECOND:
        raise MessageError(f"there is no state {data[at + 81]} of a leader, or {rest} ns are more than a second")
    motion = LeaderMotion(p, v, a)
    origin = (seconds - RECENT) * SECOND + RECENT * SECOND + rest
    return Estimate(stamp, frame, motion, origin, data[at + 80], leading)


def _encode_command(command: Command) -> bytes:
    writer = begin(command.stamp, command.frame)
    write_vector(writer, command.velocity)
    write_vector(writer, (0.0, 0.0, command.yaw_rate))
    return writer.getvalue()


def _decode_command(data: bytes) -> Command:
    stamp, frame, at = read_head(data)
    at = last_numbers(data, at, 48)
    v, turn = read_vector(data, at), read_vector(data, at + 24)
    check_finite(v[0] + v[1] + v[2] + turn[0] + turn[1] + turn[2])
    return Command(stamp, frame, v, turn[2])


def _encode_nearby(nearby: Nearby) -> bytes:
    writer = begin(nearby.stamp, nearby.frame, 4)
    write_i32_le(writer, len(nearby.bodies))
    for body in nearby.bodies:
        writer.append(int(body.kind))
        align(writer, 8)
        write_vector(writer, body.relative_position)
        write_f64_le(writer, body.radius)
        write_vector(writer, body.velocity)
    return writer.getvalue()


def _decode_nearby(data: bytes) -> Nearby:
    stamp, frame, at = read_head(data)
    if at + 4 > len(data):
        raise too_short(data)
    count: int = read_i32_le(data, at)
    at += 4
    if not 0 <= count <= LONGEST_SEQUENCE or count * SMALLEST_BODY > len(data):
        raise MessageError(f"{count} nearby bodies in {len(data)} bytes; the most is {LONGEST_SEQUENCE}")
    if not count:
        check_end(data, at)
        return Nearby(stamp, frame, ())
    first = last_numbers(data, at + 1, 64 * count - 8)  # each has a kind in the 8 bytes before its seven numbers
    bodies: list[Body] = []
    for numbers in range(first, first + 64 * count, 64):
        bodies.append(_decode_body(data, at, numbers))
        at = numbers + 56
    return Nearby(stamp, frame, tuple(bodies))


def _decode_body(data: bytes, at: int, numbers: int) -> Body:
    """Return the nearby body with its kind at `at` and its numbers at `numbers`."""
    p, radius, v = read_vector(data, numbers), read_f64_le(data, numbers + 24), read_vector(data, numbers + 32)
    check_finite(p[0] + p[1] + p[2] + radius + v[0] + v[1] + v[2])
    if radius < 0.0:
        raise MessageError(f"a nearby body of radius {radius}, below 0")
    kind = _KINDS.get(data[at])
    if kind is None:
        raise MessageError(f"there is no body of kind {data[at]}")
    return Body(kind, p, radius, v)


def _write_telemetry(writer: Writer, telemetry: Telemetry) -> None:
    writer.put("B", telemetry.state)
    writer.put_all("d", telemetry.battery, telemetry.height, telemetry.command_age)
    writer.put("B", telemetry.stop_received)


def _read_telemetry(stamp: int, frame: str, reader: Reader) -> Telemetry:
    number, (battery, height, age), stopped = reader.take("B"), reader.take_all("d", 3), reader.take("B")
    check_finite(battery + height + age)
    state = _STATES.get(number)
    if state is None:
        raise MessageError(f"there is no flight state {number}")
    if stopped not in (0, 1):
        raise MessageError(f"stop_received = {stopped}: must be 0 or 1")
    return Telemetry(stamp, frame, state, battery, height, age, bool(stopped))


def _write_signals(writer: Writer, signals: Signals) -> None:
    writer.length(len(signals.values))
    for name, value in signals.values:
        writer.text(name)
        writer.put("d", value)


def _read_signals(stamp: int, frame: str, reader: Reader) -> Signals:
    values: list[tuple[str, float]] = []
    for _ in range(reader.length()):
        name, (value,) = reader.text(), reader.take_all("d", 1)
        check_finite(value)
        values.append((name, value))
    return Signals(stamp, frame, tuple(values))


def _write_times(writer: Writer, *stamps: int) -> None:
    for stamp in stamps:
        writer.time(stamp)


class Codec(NamedTuple):
    """The writer and the reader of one kind of message; the reader raises MessageError."""

    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Any]


def _codec(write: Callable[[Writer, M], None], read: Callable[[int, str, Reader], M]) -> Codec:
    """Return the codec of a message outside the 100 Hz path: `write` and `read` are of what follows the frame."""

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
    Telemetry: _codec(_write_telemetry, _read_telemetry),
    TimeRequest: _codec(lambda writer, _: None, lambda stamp, frame, _: TimeRequest(stamp, frame)),
    TimeReply: _codec(
        lambda writer, reply: _write_times(writer, reply.requested, reply.received),
        lambda stamp, frame, reader: TimeReply(stamp, frame, reader.time(), reader.time()),
    ),
    Bids: _codec(write_bids, read_bids),
    Signals: _codec(_write_signals, _read_signals),
    Mission: _codec(write_mission, read_mission),
    Stop: _codec(
        lambda writer, stop: writer.text(stop.reason),
        lambda stamp, frame, reader: Stop(stamp, frame, reader.text()),
    ),
    Status: _codec(write_status, read_status),
    Batch: Codec(encode_batch, decode_batch),
}


def encode(message: Message) -> bytes:
    """Return the CDR bytes of `message`."""
    return CODECS[type(message)].encode(message)


def decode(kind: type[M], data: bytes) -> M:
    """Return the message of that kind in `data`; raises MessageError."""
    message: M = CODECS[kind].decode(data)
    return message
