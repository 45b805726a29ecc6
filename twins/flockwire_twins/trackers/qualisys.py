"""A QTM server as a tracker's twin: its packets, a client's commands in, answers and frames out, and its sockets.

A packet is little-endian: u32 size, u32 type, content. Source: the vendor's documentation of the real-time protocol.
"""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import asin, atan2, degrees, hypot
from struct import Struct
from xml.sax.saxutils import escape

from flockwire_core.domain.pose import Quaternion, rotate
from flockwire_core.domain.time import MICROSECOND
from flockwire_mocap.tracking import ReportedBody, TrackerFrame

from flockwire_twins.trackers.stream_server import StreamServer

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


def to_columns(q: Quaternion) -> tuple[float, ...]:
    """Return the matrix of the unit quaternion `q`: the rotated axes, column by column."""
    return (*rotate(q, (1.0, 0.0, 0.0)), *rotate(q, (0.0, 1.0, 0.0)), *rotate(q, (0.0, 0.0, 1.0)))


def to_angles(columns: Sequence[float]) -> tuple[float, float, float]:
    """Return QTM's usual angles of a rotation matrix, degrees: R = Rx(a) Ry(b) Rz(c), b from -90 to 90.

    At b = ±90 only the sum or the difference of a and c is defined: then c = 0.
    """
    ux, _, _, vx, vy, vz, wx, wy, wz = columns
    b = degrees(asin(max(-1.0, min(1.0, wx))))
    if hypot(wy, wz) < 1e-6:  # below this cosine of b, a and c cannot be distinguished
        return degrees(atan2(vz, vy)), b, 0.0
    return degrees(atan2(-wy, wz)), b, degrees(atan2(-vx, ux))


CONNECTED = 1  # the event of a server that is ready to stream
VERSIONS = ("1.25", "1.24", "1.23", "1.22", "1.21", "1.20", "1.19")
HOW_OFTEN = ("allframes", "frequency", "frequencydivisor")  # every frame is sent for any of these


class QtmTwin:
    """One client's requests. `failed`: why it is no client of this protocol, None while it is one.

    `send` sends a datagram to a port of the client's host.
    """

    def __init__(self, names: Iterable[str], send: Callable[[bytes, int], None]) -> None:
        self.failed: str | None = None
        self._send = send
        self._version_set = VERSIONS[0]
        self._components: tuple[int, ...] = ()  # requested components of each frame; empty: no frames
        self._port: int | None = None  # its port for datagrams
        self._names = tuple(names)
        self._unread = bytearray()
        self._outgoing = bytearray(encode_text(COMMAND, "QTM RT Interface connected"))

    def receive(self, data: bytes) -> None:
        """Receive bytes, split anywhere."""
        self._unread += data
        while len(self._unread) >= HEADER.size and self.failed is None:
            size, kind = HEADER.unpack_from(self._unread)
            if not HEADER.size <= size <= LONGEST:
                self.failed = f"a packet of {size} bytes"
            if self.failed is not None or len(self._unread) < size:
                return
            text = bytes(self._unread[HEADER.size : size]).partition(b"\0")[0].decode(errors="replace")
            del self._unread[:size]
            if kind == COMMAND:
                self._outgoing += self._answer(text.lower().split())

    def publish(self, frame: TrackerFrame) -> None:
        """Stream a frame, if the client has requested frames."""
        if self._components and self._port is not None:
            self._send(encode_frame(frame, self._components), self._port)
        elif self._components:
            self._outgoing += encode_frame(frame, self._components)

    def outgoing(self) -> bytes:
        """Return the bytes to be sent since the last call."""
        data = bytes(self._outgoing)
        self._outgoing.clear()
        return data

    def _answer(self, command: list[str]) -> bytes:
        answer = encode_text(ERROR, "Parse error")
        match command:
            case ["version", version] if version in VERSIONS:
                self._version_set = version
                answer = encode_text(COMMAND, f"Version set to {version}")
            case ["version", *_]:
                answer = encode_text(ERROR, "Version NOT supported")
            case ["qtmversion", *_]:
                answer = encode_text(COMMAND, "QTM Version is 2024.1 (flockwire)")
            case ["byteorder", *_]:
                answer = encode_text(COMMAND, "Byte order is little endian")
            case ["getstate", *_]:
                answer = encode(EVENT, bytes([CONNECTED]))
            case ["getparameters", *wanted] if {"6d", "all"}.intersection(wanted):
                answer = encode_parameters(self._names, self._version_set)
            case ["streamframes", *arguments]:
                answer = self._stream(arguments)
        return answer

    def _stream(self, arguments: list[str]) -> bytes:
        """Start or stop streaming; QTM sends no confirmation."""
        self._components, self._port = (), None
        if arguments == ["stop"]:
            return b""
        ports, wanted = list[str](), list[str]()
        for text in arguments:
            name, _, value = text.partition(":")
            if name == "udp":
                ports.append(value)
            elif name not in HOW_OFTEN:
                wanted.append(text)
        if not wanted or not COMPONENTS.keys() >= set(wanted) or len(ports) > 1 or not all(map(_is_port, ports)):
            return encode_text(ERROR, "Parse error")
        self._components = tuple(COMPONENTS[name] for name in dict.fromkeys(wanted))
        self._port = next(map(int, ports), None)
        return b""


def _is_port(text: str) -> bool:
    """Return whether `text` is a port; QTM also accepts an address before it, the twin does not."""
    return text.isascii() and text.isdecimal() and len(text) <= 5 and 0 < int(text) <= 65535


class QtmServer(StreamServer):
    """Serves frames to clients of QTM's real-time protocol; `names` of the bodies in the frames' order."""

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        self._names, self._from = tuple(names), address
        self._datagrams: socket.socket
        super().__init__(lambda host: QtmTwin(self._names, partial(self._send, host)), address, port)

    async def open(self) -> None:
        """Listen; raises OSError if the port is taken or the address is not there."""
        await super().open()
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.setblocking(False)
        self._datagrams.bind((self._from, 0))

    def close(self) -> None:
        """Close all connections."""
        super().close()
        self._datagrams.close()

    def _send(self, host: str, data: bytes, port: int) -> None:
        with contextlib.suppress(OSError):  # lost: no client, or the frame is too long
            self._datagrams.sendto(data, (host, port))
