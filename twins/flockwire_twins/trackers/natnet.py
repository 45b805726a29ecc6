"""A NatNet server without sockets, the twin of Motive: requests in, answers and frames out, to each receiver."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from struct import Struct, pack
from typing import NamedTuple

from flockwire_core.domain.pose import LEVEL
from flockwire_core.domain.time import SECOND
from flockwire_mocap.natnet.packets import (
    ADJUSTABLE,
    CONNECTION,
    COUNTED,
    DATA_PORT,
    GROUP,
    NEWEST,
    OLDEST,
    PRECISE_SUFFIX,
    RIGID_BODY,
    SENDER,
    SUFFIX,
    TRACKING_VALID,
    Kind,
    MalformedError,
    MocapFrame,
    Other,
    PacketReader,
    Rejected,
    ServerInfo,
    Version,
    can_adjust,
    encode,
    open_packet,
    version_of,
)
from flockwire_mocap.tracking import ReportedBody, TrackerFrame

FREQUENCY = 10_000_000  # Hz, of the performance counter of most Windows machines
LIFETIME = 5 * SECOND  # ns without a request after which a client gets no more frames
VERSION = re.compile(r"\d+\.\d+")
TURNED: Version = (4, 2)  # a rigid body's description holds a quaternion
REQUESTED_VERSION = Struct("<265xBB2x")  # a long greeting: name, versions, one option, then that version
ECHO = Struct("<Q")  # a number of the client; the answer has it again, and the server's clock in ticks
END = bytes(4)
DONE, REFUSED = bytes(4), b"\x01\x00\x00\x00"

Address = tuple[str, int]


class Connect(NamedTuple):
    """A client's greeting, with the bitstream version that it requests, if any."""

    version: Version | None = None


class RemoteCommand(NamedTuple):
    """A client's command as text, e.g. "Bitstream,3.0"."""

    text: str


class Echo(NamedTuple):
    """A client's request for the server's clock, with a number of its own."""

    number: int


Request = Connect | RemoteCommand | Echo | Other | Rejected


def parse_request(datagram: bytes) -> Request:
    """Return a client's request."""
    try:
        kind, body = open_packet(datagram)
        if kind == Kind.CONNECT:
            return _read_greeting(body)
        if kind == Kind.ECHO:
            return Echo(*body.unpack(ECHO))
        return RemoteCommand(body.loose_text()) if kind == Kind.REQUEST else Other(kind)
    except MalformedError as error:
        return Rejected(str(error))


def _read_greeting(body: PacketReader) -> Connect:
    """Read a greeting: only "Ping", or name and versions, or longer: then it may request a version, or 0.0."""
    if body.remaining < REQUESTED_VERSION.size:
        return Connect()
    major, minor = body.unpack(REQUESTED_VERSION)
    return Connect((major, minor) if major else None)


def encode_server_info(info: ServerInfo) -> bytes:
    """Return the answer to a greeting."""
    name = info.name.encode()[:255]
    head = SENDER.pack(name, *info.application_version, *info.natnet_version)
    group = bytes(map(int, info.group.split(".")))
    return encode(Kind.SERVER_INFO, head + CONNECTION.pack(info.clock_frequency, info.data_port, info.multicast, group))


def encode_model(names: Mapping[int, str], version: Version) -> bytes:
    """Return the model definition of rigid bodies, by number, without markers."""
    descriptions = [_description(identity, name, version) for identity, name in names.items()]
    return encode(Kind.MODEL, pack("<i", len(descriptions)) + b"".join(descriptions) + END)


def encode_frame(frame: MocapFrame, version: Version) -> bytes:
    """Return a frame with a section of rigid bodies, all others empty; positions are rounded to single precision."""
    bodies = b"".join(map(_body, frame.bodies))
    size, empty = (pack("<I", len(bodies)), bytes(8)) if version >= COUNTED else (b"", bytes(4))
    behind = 4 + (version >= COUNTED) + 2 * (version >= NEWEST)  # of all versions; assets; IMU and GPIO
    sections = 2 * empty + pack("<I", len(frame.bodies)) + size + bodies + behind * empty
    return encode(Kind.FRAME, pack("<i", frame.number) + sections + _suffix(frame, version) + END)


def _body(body: ReportedBody) -> bytes:
    flags = TRACKING_VALID if body.tracked else 0
    return RIGID_BODY.pack(body.identity, *body.position, *body.orientation, 0.0, flags)


def _suffix(frame: MocapFrame, version: Version) -> bytes:
    received = (frame.mid_exposure + frame.transmitted) // 2
    common = (0, 0, frame.timestamp, frame.mid_exposure, received, frame.transmitted)  # without a timecode
    if version >= ADJUSTABLE:  # the vendor's sample clients read the precision from 4.0 on
        return PRECISE_SUFFIX.pack(*common, 0, 0, frame.parameters)
    return SUFFIX.pack(*common, frame.parameters)


def _description(identity: int, name: str, version: Version) -> bytes:
    """Return a rigid body's description: no parent, no offset, no turn, no markers."""
    turn = pack("<4f", *LEVEL) if version >= TURNED else b""
    data = name.encode() + b"\0" + pack("<ii3f", identity, -1, 0.0, 0.0, 0.0) + turn + pack("<i", 0)
    return pack("<i", 1) + (pack("<I", len(data)) if version >= COUNTED else b"") + data


def announced(version: Version, multicast: bool = False, data_port: int = DATA_PORT, group: str = GROUP) -> ServerInfo:
    """Return what a server of this version announces: whether frames go to `group` at `data_port`, or each client."""
    versions = (version[0] - 1, version[1], 0, 0), (*version, 0, 0)
    return ServerInfo("flockwire", *versions, FREQUENCY, data_port, multicast, group)


@dataclass(slots=True)
class _Client:
    version: Version
    received_at: int


class NatNetTwin:
    """Answers clients with `info`, and encodes frames for them.

    `names` are of bodies by number; without any it does not answer a request for the model definition.

    A unicast client from 4.0 on may request an older bitstream, in its greeting or later by a command. The answer to
    the greeting then has that version, so it is right for clients that use the answer and for those that use their
    request; Motive's choice is not documented.
    """

    def __init__(self, info: ServerInfo, names: Mapping[int, str]) -> None:
        self.info, self.names = info, names
        self._clients: dict[Address, _Client] = {}
        self._ahead = 0  # ns, of the clock of frames before that of `now`

    def receive(self, datagram: bytes, client: Address, now: int) -> bytes | None:
        """Receive a client's datagram at `now`, ns; returns the answer, if there is one."""
        request = parse_request(datagram)
        if isinstance(request, Connect):
            wanted = request.version
            version = wanted if wanted is not None and self._supports(wanted) else self.info.version
            self._clients[client] = _Client(version, now)
            return encode_server_info(self.info._replace(natnet_version=(*version, 0, 0)))
        if client in self._clients:
            self._clients[client].received_at = now
        if isinstance(request, Echo):
            ticks = (now + self._ahead) * FREQUENCY // SECOND
            return encode(Kind.ECHOED, ECHO.pack(request.number) + ECHO.pack(ticks))
        if isinstance(request, RemoteCommand):
            return self._obey(request.text, client)
        if request == (Kind.REQUEST_MODEL,) and self.names:
            return encode_model(self.names, self._version(client))
        if request == (Kind.DISCONNECT,):
            self._clients.pop(client, None)
        return None

    def datagrams(self, frame: TrackerFrame, now: int) -> list[tuple[bytes, Address]]:
        """Return the datagrams for a frame with their addresses, at `now`, ns."""
        self._ahead = frame.transmitted - now
        sent, info = _mocap_frame(frame), self.info
        if info.multicast:
            return [(encode_frame(sent, info.version), (info.group, info.data_port))]
        self._clients = {
            address: known for address, known in self._clients.items() if now - known.received_at < LIFETIME
        }
        versions = {known.version for known in self._clients.values()}
        datagrams = {version: encode_frame(sent, version) for version in versions}
        return [(datagrams[known.version], address) for address, known in self._clients.items()]

    def _supports(self, version: Version) -> bool:
        return can_adjust(self.info.version, self.info.multicast) and OLDEST <= version <= self.info.version

    def _version(self, client: Address) -> Version:
        known = self._clients.get(client)
        return self.info.version if known is None else known.version

    def _obey(self, command: str, client: Address) -> bytes:
        """Execute a command: "Bitstream" returns the client's version, "Bitstream,3.1" changes it."""
        name, _, argument = command.partition(",")
        if name != "Bitstream":
            return encode(Kind.UNRECOGNIZED)
        if not argument:
            return encode(Kind.RESPONSE, "Bitstream,{}.{}\0".format(*self._version(client)).encode())
        known = self._clients.get(client)
        if known is None or not (VERSION.fullmatch(argument) and self._supports(version_of(argument))):
            return encode(Kind.RESPONSE, REFUSED)
        known.version = version_of(argument)
        return encode(Kind.RESPONSE, DONE)


def _mocap_frame(frame: TrackerFrame) -> MocapFrame:
    """Return the frame in NatNet's terms: its stamps in ticks, all bodies, lost ones too."""
    captured, transmitted = (stamp * FREQUENCY // SECOND for stamp in (frame.captured, frame.transmitted))
    return MocapFrame(frame.number, frame.bodies, frame.captured / SECOND, captured, transmitted, 0)
