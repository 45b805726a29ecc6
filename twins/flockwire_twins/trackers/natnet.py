"""A NatNet server without sockets, the twin of Motive: its answers, and the receivers of each frame."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from flockwire_core.domain.time import SECOND
from flockwire_mocap.natnet.packets import (
    DATA_PORT,
    ECHO,
    GROUP,
    OLDEST,
    Connect,
    Echo,
    Kind,
    MocapFrame,
    RemoteCommand,
    ServerInfo,
    Version,
    can_adjust,
    encode,
    encode_frame,
    encode_model,
    encode_server_info,
    version_of,
)
from flockwire_mocap.natnet.parsing import parse_request
from flockwire_mocap.tracking import TrackerFrame

FREQUENCY = 10_000_000  # Hz, of the performance counter of most Windows machines
LIFETIME = 5 * SECOND  # ns without a request after which a client gets no more frames
VERSION = re.compile(r"\d+\.\d+")
DONE, REFUSED = bytes(4), b"\x01\x00\x00\x00"

Address = tuple[str, int]


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
