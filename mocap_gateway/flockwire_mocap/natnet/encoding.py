"""Encodes packets as datagrams: those of a server (the twin) and those of a client."""

from __future__ import annotations

from collections.abc import Iterable
from struct import pack

from flockwire_core.domain.quaternion import IDENTITY

from flockwire_mocap.natnet.packets import (
    ADJUSTABLE,
    CONNECTION,
    COUNTED,
    HEADER,
    NEWEST,
    PRECISE_SUFFIX,
    RIGID_BODY,
    SENDER,
    SUFFIX,
    TRACKING_VALID,
    TURNED,
    BodyDescription,
    Kind,
    MocapFrame,
    ServerInfo,
    Stamps,
    Version,
)
from flockwire_mocap.tracking import ReportedBody

END = bytes(4)


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


def encode_server_info(info: ServerInfo) -> bytes:
    """Return the answer to a greeting."""
    name = info.name.encode()[:255]
    head = SENDER.pack(name, *info.application_version, *info.natnet_version)
    group = bytes(map(int, info.group.split(".")))
    return encode(Kind.SERVER_INFO, head + CONNECTION.pack(info.clock_frequency, info.data_port, info.multicast, group))


def encode_model(bodies: Iterable[BodyDescription], version: Version) -> bytes:
    """Return the model definition of rigid bodies without markers."""
    descriptions = [_description(body, version) for body in bodies]
    return encode(Kind.MODEL, pack("<i", len(descriptions)) + b"".join(descriptions) + END)


def encode_frame(frame: MocapFrame, version: Version) -> bytes:
    """Return a frame with a section of rigid bodies, all others empty; positions are rounded to single precision."""
    bodies = b"".join(map(_body, frame.bodies))
    size, empty = (pack("<I", len(bodies)), bytes(8)) if version >= COUNTED else (b"", bytes(4))
    behind = 4 + (version >= COUNTED) + 2 * (version >= NEWEST)  # of all versions; assets; IMU and GPIO
    sections = 2 * empty + pack("<I", len(frame.bodies)) + size + bodies + behind * empty
    suffix = _suffix(frame.stamps, frame.parameters, version)
    return encode(Kind.FRAME, pack("<i", frame.number) + sections + suffix + END)


def _body(body: ReportedBody) -> bytes:
    flags = TRACKING_VALID if body.tracked else 0
    return RIGID_BODY.pack(body.identity, *body.position, *body.orientation, 0.0, flags)


def _suffix(stamps: Stamps, parameters: int, version: Version) -> bytes:
    received = (stamps.mid_exposure + stamps.transmitted) // 2
    common = (0, 0, stamps.timestamp, stamps.mid_exposure, received, stamps.transmitted)  # without a timecode
    if version >= ADJUSTABLE:  # the vendor's sample clients read the precision from 4.0 on
        return PRECISE_SUFFIX.pack(*common, 0, 0, parameters)
    return SUFFIX.pack(*common, parameters)


def _description(body: BodyDescription, version: Version) -> bytes:
    """Return a rigid body's description: no parent, no offset, no turn, no markers."""
    turn = pack("<4f", *IDENTITY) if version >= TURNED else b""
    data = body.name.encode() + b"\0" + pack("<ii3f", body.identity, -1, 0.0, 0.0, 0.0) + turn + pack("<i", 0)
    return pack("<i", 1) + (pack("<I", len(data)) if version >= COUNTED else b"") + data
