"""The codec of all messages; no other file knows their layout.

The payloads are ROS 2 messages in CDR (schemas.py), so that a trace or a bridge needs no translation. Each starts with
its stamp, Unix ns (the time for which the content is valid), and the name of the world frame.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, Protocol, TypeVar

from flockwire_core.domain.airframe import Command, FlightState, Steer, Telemetry
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.law_message import LawMessage, Signals
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import TimeReply, TimeRequest
from flockwire_core.domain.vector import ZERO
from flockwire_core.wire.batch import Batch, read_batch, write_batch
from flockwire_core.wire.cdr import MessageError, Reader, Writer, begun
from flockwire_core.wire.law_form import read_law_message, write_law_message
from flockwire_core.wire.orders import read_mission, write_mission
from flockwire_core.wire.sighting import Sighting, read_sighting, write_sighting
from flockwire_core.wire.status import Status, read_status, write_status


class Message(Protocol):
    """The common part of all messages."""

    @property
    def stamp(self) -> int:
        """Unix time in ns for which the content is valid."""

    @property
    def frame(self) -> str:
        """The name of the world frame."""


M = TypeVar("M", bound=Message)

_KINDS: Final[dict[int, BodyKind]] = {int(kind): kind for kind in BodyKind}
_LEADING: Final[dict[int, Leading]] = {int(state): state for state in Leading}
_STATES: Final[dict[int, FlightState]] = {int(state): state for state in FlightState}


def _encode_pose(pose: Pose) -> bytes:
    writer = begun(pose.stamp, pose.frame)
    writer.vector(pose.position)
    writer.quaternion(pose.orientation)
    return writer.finish()


def _decode_pose(data: bytes) -> Pose:
    reader = Reader(data)
    pose = Pose(reader.time(), reader.text(), reader.vector(), reader.quaternion())
    reader.end()
    return pose


def _encode_estimate(estimate: Estimate) -> bytes:
    writer, motion = begun(estimate.stamp, estimate.frame), estimate.motion
    writer.vector(motion.position)
    writer.vector(motion.velocity)
    writer.vector(motion.acceleration)
    writer.time(estimate.origin)
    writer.byte(estimate.hops)
    writer.byte(int(estimate.leading))
    return writer.finish()


def _decode_estimate(data: bytes) -> Estimate:
    reader = Reader(data)
    stamp, frame = reader.time(), reader.text()
    motion = LeaderMotion(reader.vector(), reader.vector(), reader.vector())
    origin, hops, state = reader.time(), reader.byte(), reader.byte()
    leading = _LEADING.get(state)
    if leading is None:
        raise MessageError(f"there is no state {state} of a leader")
    reader.end()
    return Estimate(stamp, frame, motion, origin, hops, leading)


def _encode_command(command: Command) -> bytes:
    writer = begun(command.stamp, command.frame)
    writer.vector(command.velocity)
    writer.vector((0.0, 0.0, command.yaw_rate))
    writer.vector(command.acceleration)
    return writer.finish()


def _decode_command(data: bytes) -> Command:
    reader = Reader(data)
    command = Command(reader.time(), reader.text(), reader.vector(), reader.vector()[2], reader.vector())
    reader.end()
    return command


def _encode_nearby(nearby: Nearby) -> bytes:
    writer = begun(nearby.stamp, nearby.frame)
    writer.unsigned(len(nearby.bodies))
    for body in nearby.bodies:
        writer.byte(int(body.kind))
        writer.vector(body.relative_position)
        writer.double(body.radius)
        writer.vector(body.velocity)
    return writer.finish()


def _decode_nearby(data: bytes) -> Nearby:
    reader = Reader(data)
    stamp, frame, count = reader.time(), reader.text(), reader.length()
    if count * 57 > reader.left:  # least bytes of a nearby body
        raise MessageError(f"{count} nearby bodies in {reader.left} bytes")
    nearby = Nearby(stamp, frame, tuple([_read_body(reader) for _ in range(count)]))
    reader.end()
    return nearby


def _read_body(reader: Reader) -> Body:
    number, relative_position, radius = reader.byte(), reader.vector(), reader.double()
    if radius < 0.0:
        raise MessageError(f"a nearby body of radius {radius}, below 0")
    kind = _KINDS.get(number)
    if kind is None:
        raise MessageError(f"there is no body of kind {number}")
    return Body(kind, relative_position, radius, reader.vector())


def _write_steer(writer: Writer, steer: Steer) -> None:
    writer.vector(steer.velocity)
    writer.vector(ZERO)


def _read_steer(stamp: int, frame: str, reader: Reader) -> Steer:
    steer = Steer(stamp, frame, reader.vector())
    reader.vector()  # a leader does not turn
    return steer


def _write_telemetry(writer: Writer, telemetry: Telemetry) -> None:
    writer.byte(int(telemetry.state))
    writer.vector((telemetry.battery, telemetry.height, telemetry.command_age))
    writer.byte(int(telemetry.stop_received))


def _read_telemetry(stamp: int, frame: str, reader: Reader) -> Telemetry:
    number, (battery, height, age), stopped = reader.byte(), reader.vector(), reader.byte()
    state = _STATES.get(number)
    if state is None:
        raise MessageError(f"there is no flight state {number}")
    if stopped not in (0, 1):
        raise MessageError(f"stop_received = {stopped}: must be 0 or 1")
    return Telemetry(stamp, frame, state, battery, height, age, bool(stopped))


def _write_signals(writer: Writer, signals: Signals) -> None:
    writer.unsigned(len(signals.values))
    for name, value in signals.values:
        writer.text(name)
        writer.double(value)


def _read_signals(stamp: int, frame: str, reader: Reader) -> Signals:
    return Signals(stamp, frame, tuple([(reader.text(), reader.double()) for _ in range(reader.length())]))


def _write_reply(writer: Writer, reply: TimeReply) -> None:
    writer.time(reply.requested)
    writer.time(reply.received)


class Codec(NamedTuple):
    """The codec of one kind of message; `decode` raises MessageError."""

    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Any]


def _codec(write: Callable[[Writer, M], None], read: Callable[[int, str, Reader], M]) -> Codec:
    """Return the codec of a message outside the 100 Hz path: `write` and `read` are of what follows the frame.

    Called through them, the messages of that path would take 8 % of the virtual time more.
    """

    def encode(message: M) -> bytes:
        writer = begun(message.stamp, message.frame)
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
    Steer: _codec(_write_steer, _read_steer),
    Nearby: Codec(_encode_nearby, _decode_nearby),
    Telemetry: _codec(_write_telemetry, _read_telemetry),
    TimeRequest: _codec(lambda writer, _: None, lambda stamp, frame, _: TimeRequest(stamp, frame)),
    TimeReply: _codec(_write_reply, lambda stamp, frame, reader: TimeReply(stamp, frame, reader.time(), reader.time())),
    LawMessage: _codec(write_law_message, read_law_message),
    Sighting: _codec(write_sighting, read_sighting),
    Signals: _codec(_write_signals, _read_signals),
    Mission: _codec(write_mission, read_mission),
    Stop: _codec(
        lambda writer, stop: writer.text(stop.reason), lambda stamp, frame, reader: Stop(stamp, frame, reader.text())
    ),
    Status: _codec(write_status, read_status),
    Batch: _codec(write_batch, read_batch),
}


def encode(message: Message) -> bytes:
    """Return the CDR bytes of `message`."""
    return CODECS[type(message)].encode(message)


def decode(kind: type[M], data: bytes) -> M:
    """Return the message of that kind in `data`; raises MessageError."""
    message: M = CODECS[kind].decode(data)
    return message
