"""The packets of QTM's real-time server, as far as its twin needs them: little-endian u32 size, u32 type, content."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from struct import Struct, pack
from xml.sax.saxutils import escape

from flockwire_core.domain.time import MICROSECOND
from flockwire_mocap.qualisys.rotation import to_angles, to_columns
from flockwire_mocap.tracking import ReportedBody, TrackerFrame

PORT = 22223  # of clients that read little-endian
ERROR, COMMAND, XML, DATA, EVENT = 0, 1, 2, 3, 6  # the types
UNLABELLED, SIX_DEGREES, EULER = 2, 5, 6  # the components: markers, bodies with a rotation matrix, with three angles
COMPONENTS = {"3dnolabels": UNLABELLED, "6d": SIX_DEGREES, "6deuler": EULER}  # by their names in a client's command
LONGEST = 1 << 16  # bytes of a client's packet
HEADER = Struct("<II")
_DATA = Struct("<qII")  # us since the measurement began, number of the frame, components
_COMPONENT = Struct("<IIIHH")  # size, type, bodies, 2D drop rate, 2D out of sync rate
_BODY = Struct("<12f")  # mm, rotation matrix column by column; NaN if the body is lost
_TURNED = Struct("<6f")  # mm, degrees about x, y, z
_NAN = float("nan")


def encode(kind: int, content: bytes) -> bytes:
    """Return a packet."""
    return HEADER.pack(HEADER.size + len(content), kind) + content


def encode_text(kind: int, text: str) -> bytes:
    """Return a command's answer, an error or XML."""
    return encode(kind, text.encode() + b"\0")


def encode_parameters(names: Iterable[str], version: str) -> bytes:
    """Return the settings of the bodies: their names in the order of the frames."""
    bodies = [f"<Body><Name>{escape(name)}</Name><RGBColor>0</RGBColor></Body>" for name in names]
    text, tag = f"<Bodies>{len(bodies)}</Bodies>{''.join(bodies)}", f"QTM_Parameters_Ver_{version}"
    return encode_text(XML, f"<{tag}><The_6D>{text}</The_6D></{tag}>")


def encode_frame(frame: TrackerFrame, components: Sequence[int] = (SIX_DEGREES,)) -> bytes:
    """Return a frame: in each component all bodies, those that are not tracked as NaN; there are no loose markers."""
    parts = [_component(kind, frame.bodies) for kind in components]
    head = _DATA.pack(frame.captured // MICROSECOND, frame.number & 0xFFFFFFFF, len(parts))
    return encode(DATA, head + b"".join(parts))


def encode_event(number: int) -> bytes:
    """Return a change of QTM's state."""
    return encode(EVENT, pack("<B", number))


def _component(kind: int, bodies: Sequence[ReportedBody]) -> bytes:
    rows = [] if kind == UNLABELLED else [_row(kind, body) for body in bodies]
    content = b"".join(rows)
    return _COMPONENT.pack(_COMPONENT.size + len(content), kind, len(rows), 0, 0) + content


def _row(kind: int, body: ReportedBody) -> bytes:
    layout = _TURNED if kind == EULER else _BODY
    if not body.tracked:
        return layout.pack(*[_NAN] * (6 if kind == EULER else 12))
    columns = to_columns(body.orientation)
    return layout.pack(*body.position, *(to_angles(columns) if kind == EULER else columns))
