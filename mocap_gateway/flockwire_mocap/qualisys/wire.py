"""The packets of QTM's real-time server, as far as its twin needs them: little-endian u32 size, u32 type, content."""

from __future__ import annotations

from collections.abc import Iterable
from struct import Struct, pack
from xml.sax.saxutils import escape

from flockwire.nanoseconds import THOUSAND

from flockwire_mocap.qualisys.rotation import to_columns
from flockwire_mocap.tracking import ReportedBody, TrackerFrame

PORT = 22223  # of clients that read little-endian
ERROR, COMMAND, XML, DATA, EVENT = 0, 1, 2, 3, 6  # the types
SIX_DEGREES = 5  # the component of bodies with position and rotation matrix
LONGEST = 1 << 16  # bytes of a client's packet
HEADER = Struct("<II")
_DATA = Struct("<qII")  # us since the measurement began, number of the frame, components
_COMPONENT = Struct("<IIIHH")  # size, type, bodies, 2D drop rate, 2D out of sync rate
_BODY = Struct("<12f")  # mm, rotation matrix column by column; NaN where the body is lost
_LOST = _BODY.pack(*[float("nan")] * 12)


def encode(kind: int, content: bytes) -> bytes:
    """Return a packet."""
    return HEADER.pack(HEADER.size + len(content), kind) + content


def encode_text(kind: int, text: str) -> bytes:
    """Return a command's answer, an error or XML."""
    return encode(kind, text.encode() + b"\0")


def encode_parameters(names: Iterable[str]) -> bytes:
    """Return the settings of the bodies: their names in the order of the frames."""
    bodies = [f"<Body><Name>{escape(name)}</Name></Body>" for name in names]
    text = f"<Bodies>{len(bodies)}</Bodies>{''.join(bodies)}"
    return encode_text(XML, f"<QTM_Parameters_Ver_1.25><The_6D>{text}</The_6D></QTM_Parameters_Ver_1.25>")


def encode_frame(frame: TrackerFrame) -> bytes:
    """Return a frame: all bodies, those that are not tracked as NaN."""
    bodies = b"".join(_BODY.pack(*_numbers(body)) if body.tracked else _LOST for body in frame.bodies)
    component = _COMPONENT.pack(_COMPONENT.size + len(bodies), SIX_DEGREES, len(frame.bodies), 0, 0)
    return encode(DATA, _DATA.pack(frame.captured // THOUSAND, frame.number & 0xFFFFFFFF, 1) + component + bodies)


def encode_event(number: int) -> bytes:
    """Return a change of QTM's state."""
    return encode(EVENT, pack("<B", number))


def _numbers(body: ReportedBody) -> tuple[float, ...]:
    return (*body.position, *to_columns(body.orientation))
