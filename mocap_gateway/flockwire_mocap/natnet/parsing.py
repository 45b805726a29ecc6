"""Parses datagrams of a server. Nothing is raised: an unreadable datagram is `Rejected`.

A frame of motion capture data: i32 frame number; marker sets; other markers; rigid bodies; skeletons; from 4.1 assets;
labelled markers; force plates; devices; from 4.5 IMU and GPIO; suffix; an end marker of four bytes, not checked. Up to
4.0 a section is an i32 count and its elements; from 4.1 on a u32 size in bytes is between both, and only the size is
used. Only rigid bodies and stamps are read.

A model definition: i32 count of descriptions; each an i32 type, from 4.1 on a u32 size in bytes, and the description.
From 4.1 on only the size is used. Before, an unknown type ends the reading, and the descriptions read so far are kept.
Only the names of rigid bodies are read.
"""

from __future__ import annotations

from struct import Struct

from flockwire_mocap.natnet.packets import (
    ADJUSTABLE,
    CONNECTION,
    COUNTED,
    PRECISE_SUFFIX,
    RIGID_BODY,
    SENDER,
    SUFFIX,
    TEXT,
    TRACKING_VALID,
    Kind,
    Layout,
    MalformedError,
    MocapFrame,
    ModelDefinition,
    Other,
    Packet,
    PacketReader,
    Rejected,
    Response,
    ServerInfo,
    Version,
    open_packet,
)
from flockwire_mocap.tracking import ReportedBody

_MARKERS: Layout = (12,)  # each x y z
_CHANNELS: Layout = (4, ((4,),))  # id, and of each channel its samples
BEFORE_BODIES: Layout = ((TEXT, _MARKERS), _MARKERS)  # marker sets, other markers
# Skeletons; labelled markers, each id, x y z, size, parameters, residual; force plates; devices.
AFTER_BODIES: Layout = ((4, (RIGID_BODY.size,)), (26,), _CHANNELS, _CHANNELS)

RIGID_BODY_TYPE, SKELETON_TYPE = 1, 2
_SIZE = Struct("<I")
_OTHERS: dict[int, Layout] = {  # by type
    0: (TEXT, (TEXT,)),  # a marker set
    3: (4, TEXT, 4 * (2 + 3 + 144 + 12 + 2), (TEXT,)),  # a force plate: size, origin, 12 x 12, 4 corners, two types
    4: (4, TEXT, TEXT, 8, (TEXT,)),  # a device
    5: (TEXT, 12 + 16),  # a camera: x y z, quaternion
}


def parse(datagram: bytes, version: Version | None) -> Packet:
    """Return a server's packet; frames and models need the `version` of the stream, None if not known."""
    try:
        kind, body = open_packet(datagram)
        if kind == Kind.SERVER_INFO:
            return _read_server_info(body)
        if kind == Kind.RESPONSE:
            return Response(None, body.integer()) if body.remaining == 4 else Response(body.loose_text(), None)
        if kind not in {Kind.FRAME, Kind.MODEL}:
            return Other(kind)
        if version is None:
            return Rejected("the version of the stream is not known yet")
        return read_frame(body, version) if kind == Kind.FRAME else read_model(body, version)
    except MalformedError as error:
        return Rejected(str(error))


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


def read_frame(reader: PacketReader, version: Version) -> MocapFrame:
    """Read the body of a frame packet; raises MalformedError."""
    number = reader.integer()
    bodies = _counted_sections(reader) if version >= COUNTED else _walked_sections(reader)
    return MocapFrame(number, bodies, *_suffix(reader, version))


def _counted_sections(reader: PacketReader) -> tuple[ReportedBody, ...]:
    for _ in ("marker sets", "other markers"):
        reader.section()
    bodies = _counted_bodies(*reader.section())
    for _ in ("skeletons", "assets", "labelled markers", "force plates", "devices"):
        reader.section()
    # bytes of a section's count and size
    while reader.remaining >= PRECISE_SUFFIX.size + 8:  # IMU, GPIO, and possible later sections
        reader.section()
    return bodies


def _counted_bodies(count: int, section: PacketReader) -> tuple[ReportedBody, ...]:
    """Read bodies of equal size: fields that a later version appends to each are skipped."""
    if not count:
        return ()
    length, surplus = divmod(section.remaining, count)
    if surplus or length < RIGID_BODY.size:
        raise MalformedError(f"{count} rigid bodies in {section.remaining} bytes")
    return tuple(_body(section.part(length)) for _ in range(count))


def _walked_sections(reader: PacketReader) -> tuple[ReportedBody, ...]:
    reader.pass_over(BEFORE_BODIES)
    bodies = tuple(_body(reader) for _ in range(reader.count(RIGID_BODY.size)))
    reader.pass_over(AFTER_BODIES)
    return bodies


def _body(reader: PacketReader) -> ReportedBody:
    identity, x, y, z, qx, qy, qz, qw, _, parameters = reader.unpack(RIGID_BODY)
    return ReportedBody(identity, None, (x, y, z), (qx, qy, qz, qw), bool(parameters & TRACKING_VALID))


def _suffix(reader: PacketReader, version: Version) -> tuple[float, int, int, int]:
    """Read the suffix. Sources disagree whether 4.0 has the precision fields: the number of remaining bytes decides."""
    precise = version >= COUNTED or (version >= ADJUSTABLE and reader.remaining >= PRECISE_SUFFIX.size)
    _, _, timestamp, exposed, _, sent, *_, parameters = reader.unpack(PRECISE_SUFFIX if precise else SUFFIX)
    return timestamp, exposed, sent, parameters


def read_model(reader: PacketReader, version: Version) -> ModelDefinition:
    """Read the body of a model definition; raises MalformedError if not even the count of descriptions is there."""
    names: dict[int, str] = {}
    for _ in range(reader.count(8 if version >= COUNTED else 4)):
        try:
            _read_description(reader, version, names)
        except MalformedError:
            return ModelDefinition(names, complete=False)
    return ModelDefinition(names, complete=True)


def _read_description(reader: PacketReader, version: Version, names: dict[int, str]) -> None:
    """Read a description; add a rigid body to `names`."""
    kind = reader.integer()
    if version >= COUNTED:
        part = reader.part(reader.unpack(_SIZE)[0])
        if kind == RIGID_BODY_TYPE:
            names.update([_read_head(part)])
    elif kind == RIGID_BODY_TYPE:
        names.update([_described_body(reader, version)])
    elif kind == SKELETON_TYPE:
        _read_head(reader)
        for _ in range(reader.count(25)):
            _described_body(reader, version)
    elif kind in _OTHERS:
        reader.pass_over(_OTHERS[kind])
    else:
        raise MalformedError(f"a description of type {kind}")


def _read_head(reader: PacketReader) -> tuple[int, str]:
    name = reader.text()
    return reader.integer(), name


def _described_body(reader: PacketReader, version: Version) -> tuple[int, str]:
    """Read a rigid body: name, id, parent's id, offset, its markers' offsets, labels and (from 4.0) names."""
    head = _read_head(reader)
    reader.skip(4 + 12)
    markers = reader.count(12 + 4)
    reader.skip(markers * (12 + 4))
    if version >= ADJUSTABLE:
        reader.pass_over((TEXT,) * markers)
    return head
