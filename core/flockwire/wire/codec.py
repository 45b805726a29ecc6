"""The wire: how each message stands in bytes; nothing else knows the layout of one.

The payloads are ROS 2 messages in CDR (schemas.py), so that a trace or a bridge needs no translation. Each begins with
its stamp, Unix ns: the time for which the content holds, and the name of the world frame. The messages of the 100 Hz
path are numbers from there on, and one compiled struct each; the others hold texts and sequences.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import isfinite
from struct import Struct, calcsize, error
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from flockwire.domain.airframe import Command, FlightState, Telemetry
from flockwire.domain.body import Body, BodyKind, Nearby
from flockwire.domain.motion import Estimate, LeaderMotion, Leading
from flockwire.domain.order import Mission, Stop
from flockwire.domain.pose import IdentityDoubt, Pose
from flockwire.domain.time import SECOND, TimeReply, TimeRequest
from flockwire.wire.cdr import HEADER, LONGEST_SEQUENCE, MessageError, Reader, Writer, layout
from flockwire.wire.orders import read_mission, read_stop, write_mission, write_stop
from flockwire.wire.status import Status, read_status, write_status


class Message(Protocol):
    """What all messages share."""

    @property
    def stamp(self) -> int:
        """Unix time in ns for which the content holds."""

    @property
    def frame(self) -> str:
        """The name of the world frame."""


M = TypeVar("M", bound=Message)
Numbers = tuple[Any, ...]
BODY = "Bddddddd"  # of a nearby body: kind, relative position, radius, velocity
BODY_SIZE = calcsize(f"<{BODY}")  # bytes that it takes at least


_KINDS: dict[int, BodyKind] = {int(kind): kind for kind in BodyKind}
_STATES: dict[int, FlightState] = {int(state): state for state in FlightState}
_LEADING: dict[int, Leading] = {int(state): state for state in Leading}


class NumberForm(NamedTuple, Generic[M]):
    """A message of numbers: a struct code for each, what they are of a message, and the message that they make.

    With `each` the first number is a count, and so many times these codes follow `codes`. `unknown` says what is wrong
    where `message` raises KeyError for a number.
    """

    kind: type[M]
    codes: str
    numbers: Callable[[M], Numbers]
    message: Callable[[int, str, Numbers], M]
    each: str = ""
    unknown: str = ""


class TextForm(NamedTuple, Generic[M]):
    """A message with texts or sequences: what writes and what reads all behind its stamp and frame."""

    kind: type[M]
    write: Callable[[Writer, M], None]
    read: Callable[[int, str, Reader], M]


def _time(seconds: int, rest: int) -> int:
    """Return a builtin_interfaces/Time in ns."""
    if rest >= SECOND:
        raise MessageError(f"{rest} ns are more than a second")
    return seconds * SECOND + rest


def _estimate(stamp: int, frame: str, v: Numbers) -> Estimate:
    return Estimate(stamp, frame, LeaderMotion(v[:3], v[3:6], v[6:9]), _time(v[9], v[10]), v[11], _LEADING[v[12]])


def _nearby_numbers(nearby: Nearby) -> Numbers:
    bodies = nearby.bodies
    numbers: list[float] = [len(bodies)]
    for kind, (x, y, z), radius, (vx, vy, vz) in bodies:
        numbers += (kind, x, y, z, radius, vx, vy, vz)
    return tuple(numbers)


def _nearby(stamp: int, frame: str, v: Numbers) -> Nearby:
    if v[0] and min(v[5::8]) < 0.0:
        raise MessageError(f"a nearby body of radius {min(v[5::8])}, below 0")
    items = zip(*([iter(v[1:])] * 8), strict=True)
    bodies = [Body(_KINDS[kind], (x, y, z), r, (vx, vy, vz)) for kind, x, y, z, r, vx, vy, vz in items]
    return Nearby(stamp, frame, tuple(bodies))


def _telemetry(stamp: int, frame: str, v: Numbers) -> Telemetry:
    if v[4] not in (0, 1):
        raise MessageError(f"stop_received = {v[4]}: must be 0 or 1")
    return Telemetry(stamp, frame, _STATES[v[0]], v[1], v[2], v[3], bool(v[4]))


_NUMBERS: dict[type[Any], NumberForm[Any]] = {
    form.kind: form
    for form in (
        NumberForm(
            Pose, "ddddddd", lambda m: (*m.position, *m.orientation),
            lambda stamp, frame, v: Pose(stamp, frame, v[:3], v[3:]),
        ),
        NumberForm(
            Estimate, "dddddddddiIBB",
            lambda m: (*m.motion[0], *m.motion[1], *m.motion[2], *divmod(m.origin, SECOND), m.hops, m.leading),
            _estimate, unknown="there is no state {} of a leader",
        ),
        NumberForm(
            Command, "dddddd", lambda m: (*m.velocity, 0.0, 0.0, m.yaw_rate),
            lambda stamp, frame, v: Command(stamp, frame, v[:3], v[5]),
        ),
        NumberForm(Nearby, "I", _nearby_numbers, _nearby, each=BODY, unknown="there is no body of kind {}"),
        NumberForm(
            IdentityDoubt, "iI", lambda m: divmod(m.since, SECOND),
            lambda stamp, frame, v: IdentityDoubt(stamp, frame, _time(*v)),
        ),
        NumberForm(
            Telemetry, "BdddB", lambda m: m[2:], _telemetry, unknown="there is no flight state {}",
        ),
        NumberForm(TimeRequest, "", lambda _: (), lambda stamp, frame, _: TimeRequest(stamp, frame)),
        NumberForm(
            TimeReply, "iIiI", lambda m: (*divmod(m.requested, SECOND), *divmod(m.received, SECOND)),
            lambda stamp, frame, v: TimeReply(stamp, frame, _time(v[0], v[1]), _time(v[2], v[3])),
        ),
    )
}  # fmt: skip
_TEXTS: dict[type[Any], TextForm[Any]] = {
    form.kind: form
    for form in (
        TextForm(Mission, write_mission, read_mission),
        TextForm(Stop, write_stop, read_stop),
        TextForm(Status, write_status, read_status),
    )
}


def encode(message: Message) -> bytes:
    """Return the CDR bytes of `message`."""
    kind, stamp, frame = type(message), message.stamp, message.frame
    if kind in _TEXTS:
        writer = Writer()
        writer.time(stamp)
        writer.text(frame)
        _TEXTS[kind].write(writer, message)
        return writer.finish()
    form = _NUMBERS[kind]
    numbers = form.numbers(message)
    codes = _repeated(form.codes, form.each, numbers[0]) if form.each else form.codes
    struct, length, raw = _packed(frame, codes)
    return struct.pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, *numbers)


def decode(kind: type[M], data: bytes) -> M:
    """Return the message of that kind that `encode` made `data` of; raises MessageError.

    All numbers must be finite, and nothing but padding may follow them.
    """
    if kind in _TEXTS:
        texts: TextForm[M] = _TEXTS[kind]
        reader = Reader(data)
        message = texts.read(reader.time(), reader.text(), reader)
        reader.end()
        return message
    form: NumberForm[M] = _NUMBERS[kind]
    try:
        codes = _counted(form, data) if form.each else form.codes
        struct = _fitting(data[12:16], len(data), codes)
        found = struct.unpack_from(data)
    except error:
        raise MessageError(f"ends after {len(data)} bytes, too soon") from None
    header, seconds, rest, _, raw = found[:5]
    numbers = found[5:]
    if header != HEADER or rest >= SECOND:
        raise MessageError("the header is not that of a stamped message in little-endian CDR")
    if len(data) != struct.size and (len(data) - struct.size > 3 or any(data[struct.size :])):
        raise MessageError(f"{len(data) - struct.size} bytes are left over")
    if not isfinite(sum(numbers)):
        raise MessageError("holds a number that is not finite")
    try:
        return form.message(seconds * SECOND + rest, _text(raw), numbers)
    except KeyError as number:
        raise MessageError(form.unknown.format(number)) from None


def _counted(form: NumberForm[Any], data: bytes) -> str:
    """Return the codes of a message that holds a count, which must fit the size of `data`."""
    count = _fitting(data[12:16], len(data), form.codes).unpack_from(data)[5]
    if count > LONGEST_SEQUENCE or count * BODY_SIZE > len(data):
        raise MessageError(f"{count} bodies in {len(data)} bytes; the most is {LONGEST_SEQUENCE}")
    return _repeated(form.codes, form.each, count)


@lru_cache(maxsize=256)
def _repeated(codes: str, each: str, count: int) -> str:
    return codes + each * count


@lru_cache(maxsize=256)
def _fitting(length: bytes, size: int, codes: str) -> Struct:
    """Return the struct of a message of `size` bytes, for the frame id's `length` that stands in it."""
    return layout(min(int.from_bytes(length, "little"), size), codes)


@lru_cache(maxsize=256)
def _packed(frame: str, codes: str) -> tuple[Struct, int, bytes]:
    raw = frame.encode() + b"\0"
    return layout(len(raw), codes), len(raw), raw


@lru_cache(maxsize=64)
def _text(raw: bytes) -> str:
    if not raw.endswith(b"\0"):
        raise MessageError("the frame id does not end with NUL")
    try:
        return raw[:-1].decode()
    except UnicodeDecodeError:
        raise MessageError("the frame id is not UTF-8") from None
