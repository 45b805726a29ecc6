"""The packets of NatNet as named tuples, and their numbers on the wire.

Every packet is little-endian: u16 kind, u16 length of the body, body. Lengths in m or the unit that Motive is set to;
ticks are those of the server's clock, whose frequency the server info gives.
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import NamedTuple

from flockwire_mocap.tracking import ReportedBody

Version = tuple[int, int]

COMMAND_PORT, DATA_PORT, GROUP = 1510, 1511, "239.255.42.99"
OLDEST: Version = (3, 0)
ADJUSTABLE: Version = (4, 0)  # in unicast, a client may ask for an older bitstream; markers have names
COUNTED: Version = (4, 1)  # each section is preceded by its size in bytes
TURNED: Version = (4, 2)  # a rigid body's description holds a quaternion
NEWEST: Version = (4, 5)  # IMU and GPIO sections before the suffix

HEADER = Struct("<HH")
RIGID_BODY = Struct("<i7ffH")  # id, x y z, qx qy qz qw, mean marker error, parameters
SENDER = Struct("<256s4B4B")  # a client's or a server's name, version of the application, of NatNet
CONNECTION = Struct("<QHB4s")  # clock frequency, data port, multicast, group
REQUESTED_VERSION = Struct("<265xBB2x")  # a long greeting: name, versions, one option, then that version
SUFFIX = Struct("<IIdQQQH")  # timecode, its subframe, timestamp, three ticks, parameters
PRECISE_SUFFIX = Struct("<IIdQQQIIH")  # the same with two u32 of a precision time stamp
ECHO = Struct("<Q")  # a number of the client; the answer has it again, and the server's clock in ticks
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


class BodyDescription(NamedTuple):
    """The name of a rigid body, by its number."""

    identity: int
    name: str


class ModelDefinition(NamedTuple):
    """The rigid bodies that the server streams; not `complete` if a description could not be read."""

    bodies: tuple[BodyDescription, ...]
    complete: bool


class Stamps(NamedTuple):
    """A frame's times: s since the stream began, and ticks (0: not known)."""

    timestamp: float
    mid_exposure: int
    transmitted: int


class MocapFrame(NamedTuple):
    """The rigid bodies, which have no names yet, and the stamps of a frame of motion capture data."""

    number: int
    bodies: tuple[ReportedBody, ...]
    stamps: Stamps
    parameters: int


class Response(NamedTuple):
    """The answer to a command: a text, or a `code` that is 0 for success."""

    text: str | None
    code: int | None


class Echo(NamedTuple):
    """A client's request for the server's clock, with a number of its own."""

    number: int


class Other(NamedTuple):
    """A packet without bodies: text for the user, an unrecognized request, a kind not known."""

    kind: int


class Rejected(NamedTuple):
    """A malformed packet; `reason` is a text for the user."""

    reason: str


Packet = ServerInfo | ModelDefinition | MocapFrame | Response | Other | Rejected


class Connect(NamedTuple):
    """A client's greeting, with the bitstream version that it requests, if any."""

    version: Version | None = None


class RemoteCommand(NamedTuple):
    """A client's command as text, e.g. "Bitstream,3.0"."""

    text: str


ClientPacket = Connect | RemoteCommand | Echo | Other | Rejected


def can_adjust(version: Version, multicast: bool) -> bool:
    """Return whether a client may choose an older bitstream at a server of this version."""
    return version >= ADJUSTABLE and not multicast


def version_of(text: str | None) -> Version | None:
    """Return a version that is written as "4.1"."""
    if text is None:
        return None
    major, _, minor = text.partition(".")
    return int(major), int(minor)
