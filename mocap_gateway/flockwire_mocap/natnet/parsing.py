"""Parses datagrams of a server and of a client. Nothing is raised: an unreadable datagram is `Rejected`."""

from __future__ import annotations

from flockwire_mocap.natnet.frame import read_frame
from flockwire_mocap.natnet.model import read_model
from flockwire_mocap.natnet.packets import (
    CONNECTION,
    ECHO,
    HEADER,
    REQUESTED_VERSION,
    SENDER,
    ClientPacket,
    Connect,
    Echo,
    Kind,
    Other,
    Packet,
    Rejected,
    RemoteCommand,
    Response,
    ServerInfo,
    Version,
)
from flockwire_mocap.natnet.reader import MalformedError, PacketReader


def parse(datagram: bytes, version: Version | None) -> Packet:
    """Return a server's packet; frames and models need the `version` of the stream, None if not known."""
    try:
        kind, body = _open(datagram)
        return _read(kind, body, version)
    except MalformedError as error:
        return Rejected(str(error))


def parse_request(datagram: bytes) -> ClientPacket:
    """Return a client's request."""
    try:
        kind, body = _open(datagram)
        if kind == Kind.CONNECT:
            return _read_greeting(body)
        if kind == Kind.ECHO:
            return Echo(*body.unpack(ECHO))
        return RemoteCommand(_loose_text(body)) if kind == Kind.REQUEST else Other(kind)
    except MalformedError as error:
        return Rejected(str(error))


def _read_greeting(body: PacketReader) -> Connect:
    """Read a greeting: only "Ping", or name and versions, or longer: then it may request a version, or 0.0."""
    if body.remaining < REQUESTED_VERSION.size:
        return Connect()
    major, minor = body.unpack(REQUESTED_VERSION)
    return Connect((major, minor) if major else None)


def _open(datagram: bytes) -> tuple[int, PacketReader]:
    """Return kind and body; bytes after the announced ones are ignored."""
    reader = PacketReader(datagram)
    kind, length = reader.unpack(HEADER)
    return kind, reader.part(length)


def _read(kind: int, body: PacketReader, version: Version | None) -> Packet:
    if kind in {Kind.FRAME, Kind.MODEL}:
        if version is None:
            return Rejected("the version of the stream is not known yet")
        return read_frame(body, version) if kind == Kind.FRAME else read_model(body, version)
    if kind == Kind.SERVER_INFO:
        return _read_server_info(body)
    return _read_response(body) if kind == Kind.RESPONSE else Other(kind)


def _read_server_info(body: PacketReader) -> ServerInfo:
    """Read name, versions and, from 3.0 on, clock and connection."""
    name, *versions = body.unpack(SENDER)
    frequency, port, multicast, group = 0, 0, 0, bytes(4)
    if body.remaining >= CONNECTION.size:
        frequency, port, multicast, group = body.unpack(CONNECTION)
    text = name.partition(b"\0")[0].decode(errors="replace")
    a, b, c, d, *natnet = versions
    e, f, g, h = natnet
    return ServerInfo(text, (a, b, c, d), (e, f, g, h), frequency, port, bool(multicast), ".".join(map(str, group)))


def _read_response(body: PacketReader) -> Response:
    if body.remaining == 4:
        return Response(None, body.integer())
    return Response(_loose_text(body), None)


def _loose_text(body: PacketReader) -> str:
    """Read text that may end with its NUL or with the packet."""
    if body.remaining > 4096:  # bytes of a response
        raise MalformedError(f"a text of {body.remaining} bytes")
    return body.remainder().partition(b"\0")[0].decode(errors="replace")
