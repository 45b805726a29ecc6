"""The packets of a NatNet server as named tuples, their numbers on the wire, a client's packets, and a reader.

Every packet is little-endian: u16 kind, u16 length of the body, body. Lengths in m or the unit that Motive is set to;
ticks are those of the server's clock, whose frequency the server info gives.
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct, pack
from typing import Any, NamedTuple

from flockwire_mocap.tracking import ReportedBody

Version = tuple[int, int]

COMMAND_PORT, DATA_PORT, GROUP = 1510, 1511, "239.255.42.99"
OLDEST: Version = (3, 0)
ADJUSTABLE: Version = (4, 0)  # in unicast, a client may ask for an older bitstream; markers have names
COUNTED: Version = (4, 1)  # each section is preceded by its size in bytes
NEWEST: Version = (4, 5)  # IMU and GPIO sections before the suffix

HEADER = Struct("<HH")
RIGID_BODY = Struct("<i7ffH")  # id, x y z, qx qy qz qw, mean marker error, parameters
SENDER = Struct("<256s4B4B")  # a client's or a server's name, version of the application, of NatNet
CONNECTION = Struct("<QHB4s")  # clock frequency, data port, multicast, group
SUFFIX = Struct("<IIdQQQH")  # timecode, its subframe, timestamp, three ticks, parameters
PRECISE_SUFFIX = Struct("<IIdQQQIIH")  # the same with two u32 of a precision time stamp
TRACKING_VALID = 1  # bit of a rigid body's parameters
MODELS_CHANGED = 2  # bit of a frame's parameters


class Kind(IntEnum):
    """What a packet is."""

    CONNECT = 0
    SERVER_INFO = 1
    REQUEST = 2
    RESPONSE = 3
    REQUEST_MODEL = 4
    MODEL = 5
    FRAME = 7
    TEXT = 8
    DISCONNECT = 9
    KEEP_ALIVE = 10
    ECHO = 12
    ECHOED = 13
    UNRECOGNIZED = 100


class ServerInfo(NamedTuple):
    """The server's name, version and destination of frames; `clock_frequency` in Hz, 0 if it is not given."""

    name: str
    application_version: tuple[int, int, int, int]
    natnet_version: tuple[int, int, int, int]
    clock_frequency: int
    data_port: int
    multicast: bool
    group: str

    @property
    def version(self) -> Version:
        """The version that determines the layout of packets."""
        return self.natnet_version[:2]


class ModelDefinition(NamedTuple):
    """The names of the rigid bodies by number; not `complete` if a description could not be read."""

    names: dict[int, str]
    complete: bool


class MocapFrame(NamedTuple):
    """A frame of motion capture data.

    Its rigid bodies have no names yet. Its times are s since the stream began, and ticks (0: not known).
    """

    number: int
    bodies: tuple[ReportedBody, ...]
    timestamp: float
    mid_exposure: int
    transmitted: int
    parameters: int


class Response(NamedTuple):
    """The answer to a command: a text, or a `code` that is 0 for success."""

    text: str | None
    code: int | None


class Other(NamedTuple):
    """A packet without bodies: text for the user, an unrecognized request, a kind not known."""

    kind: int


class Rejected(NamedTuple):
    """A malformed packet; `reason` is a text for the user."""

    reason: str


Packet = ServerInfo | ModelDefinition | MocapFrame | Response | Other | Rejected


def can_adjust(version: Version, multicast: bool) -> bool:
    """Return whether a client may choose an older bitstream at a server of this version."""
    return version >= ADJUSTABLE and not multicast


def version_of(text: str) -> Version:
    """Return a version that is written as "4.1"."""
    major, _, minor = text.partition(".")
    return int(major), int(minor)


def encode(kind: Kind, body: bytes = b"") -> bytes:
    """Return a packet."""
    return HEADER.pack(kind, len(body)) + body


def encode_connect() -> bytes:
    """Return a client's greeting as the vendor's clients write it: name, its version, NatNet's; no bitstream asked for.

    Some servers read all of it in any case; others check only "Ping".
    """
    return encode(Kind.CONNECT, SENDER.pack(b"Ping", 0, 0, 0, 0, *NEWEST, 0, 0))


def encode_command(text: str) -> bytes:
    """Return a client's command."""
    return encode(Kind.REQUEST, text.encode() + b"\0")


def encode_model_request(masked: bool) -> bytes:
    """Return a client's request for the model definition, `masked` with the bits of the wanted types.

    The vendor's sample sends no mask; a Motive 3.1 is reported to answer only requests that have one.
    """
    return encode(Kind.REQUEST_MODEL, pack("<I", 2) if masked else b"")  # of the mask of types: 1 << their type


TEXT = "text"
Layout = tuple["int | str | Layout", ...]
"""Fields to pass over: so many bytes; TEXT up to its NUL; an i32 count and as many elements of a layout."""

_INTEGER = Struct("<i")
_SECTION = Struct("<II")


class MalformedError(ValueError):
    """The bytes are malformed; the text gives the reason."""


class PacketReader:
    """Reads `data` from `position` up to `end` (the end of the data by default); raises MalformedError beyond it."""

    __slots__ = ("_data", "_end", "_position")

    def __init__(self, data: bytes, position: int = 0, end: int | None = None) -> None:
        self._data, self._position = data, position
        self._end = len(data) if end is None else end

    @property
    def remaining(self) -> int:
        """How many bytes are left."""
        return self._end - self._position

    def skip(self, size: int) -> int:
        """Pass over `size` bytes; returns where they begin."""
        begin = self._position
        if size < 0 or size > self._end - begin:
            raise MalformedError(f"{size} bytes are announced at {begin}, {self._end - begin} are left")
        self._position = begin + size
        return begin

    def unpack(self, form: Struct) -> tuple[Any, ...]:
        """Read a struct."""
        return form.unpack_from(self._data, self.skip(form.size))

    def integer(self) -> int:
        """Read an i32."""
        value: int = self.unpack(_INTEGER)[0]
        return value

    def count(self, least: int) -> int:
        """Read the number of elements that follow, each at least `least` (1 or more) bytes long."""
        count = self.integer()
        if not 0 <= count * least <= self.remaining:
            raise MalformedError(f"{count} elements are announced, {self.remaining} bytes are left")
        return count

    def pass_over(self, layout: Layout) -> None:
        """Pass over the fields of `layout`."""
        for field in layout:
            if isinstance(field, int):
                self.skip(field)
            elif isinstance(field, str):
                self.text()
            else:
                least = sum(part if isinstance(part, int) else 1 if isinstance(part, str) else 4 for part in field)
                count = self.count(least)
                if field == (least,):  # markers, of which there may be hundreds
                    self.skip(count * least)
                else:
                    for _ in range(count):
                        self.pass_over(field)

    def text(self) -> str:
        """Read text up to its NUL; what is not UTF-8 is replaced."""
        end = self._data.find(b"\0", self._position, self._end)
        if end < 0:
            raise MalformedError(f"the text at {self._position} does not end")
        begin = self.skip(end + 1 - self._position)
        return self._data[begin:end].decode(errors="replace")

    def loose_text(self) -> str:
        """Read text that may end with its NUL or with the packet."""
        if self.remaining > 4096:  # bytes of a response
            raise MalformedError(f"a text of {self.remaining} bytes")
        return self.remainder().partition(b"\0")[0].decode(errors="replace")

    def remainder(self) -> bytes:
        """Read all bytes that are left."""
        begin = self.skip(self.remaining)
        return self._data[begin : self._end]

    def part(self, size: int) -> PacketReader:
        """Return a reader of the next `size` bytes, and pass over them."""
        begin = self.skip(size)
        return PacketReader(self._data, begin, begin + size)

    def section(self) -> tuple[int, PacketReader]:
        """Read a section as from 4.1 on: i32 count, u32 size in bytes; returns the count and a reader of the bytes."""
        count, size = self.unpack(_SECTION)
        return count, self.part(size)


def open_packet(datagram: bytes) -> tuple[int, PacketReader]:
    """Return kind and body; bytes after the announced ones are ignored."""
    reader = PacketReader(datagram)
    kind, length = reader.unpack(HEADER)
    return kind, reader.part(length)
