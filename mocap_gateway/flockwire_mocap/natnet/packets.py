"""The packets of a NatNet server as named tuples, their numbers on the wire, and a client's packets.

Every packet is little-endian: u16 kind, u16 length of the body, body. Lengths in m or the unit that Motive is set to;
ticks are those of the server's clock, whose frequency the server info gives.
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct, pack
from typing import NamedTuple

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
