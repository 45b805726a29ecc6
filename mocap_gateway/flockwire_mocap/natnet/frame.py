"""The frame of motion capture data: rigid bodies and stamps; all other sections are skipped.

Layout: i32 frame number; marker sets; other markers; rigid bodies; skeletons; from 4.1 assets; labelled markers; force
plates; devices; from 4.5 IMU and GPIO; suffix; an end marker of four bytes, not checked. Up to 4.0 a section is an i32
count and its elements; from 4.1 on a u32 size in bytes is between both, and only the size is used.
"""

from __future__ import annotations

from struct import Struct

from flockwire_mocap.natnet.packets import (
    ADJUSTABLE,
    COUNTED,
    PRECISE_SUFFIX,
    RIGID_BODY,
    SUFFIX,
    TRACKING_VALID,
    MocapFrame,
    Stamps,
    Version,
)
from flockwire_mocap.natnet.reader import MalformedError, PacketReader
from flockwire_mocap.tracking import ReportedBody

MARKER, LABELLED_MARKER = 12, 26  # bytes of x y z; of id, x y z, size, parameters, residual
_IDENTITY = Struct("<i")


def read_frame(reader: PacketReader, version: Version) -> MocapFrame:
    """Read the body of a frame packet; raises MalformedError."""
    number = reader.integer()
    bodies = _counted_sections(reader) if version >= COUNTED else _walked_sections(reader)
    stamps, parameters = _suffix(reader, version)
    return MocapFrame(number, bodies, stamps, parameters)


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
    for _ in range(reader.count(5)):  # marker sets
        reader.text()
        reader.skip_array(MARKER)
    reader.skip_array(MARKER)  # other markers
    bodies = tuple(_body(reader) for _ in range(reader.count(RIGID_BODY.size)))
    for _ in range(reader.count(8)):  # skeletons
        reader.unpack(_IDENTITY)
        reader.skip_array(RIGID_BODY.size)
    reader.skip_array(LABELLED_MARKER)
    for _ in ("force plates", "devices"):
        for _ in range(reader.count(8)):
            reader.unpack(_IDENTITY)
            for _ in range(reader.count(4)):  # channels
                reader.skip_array(4)
    return bodies


def _body(reader: PacketReader) -> ReportedBody:
    identity, x, y, z, qx, qy, qz, qw, _, parameters = reader.unpack(RIGID_BODY)
    return ReportedBody(identity, None, (x, y, z), (qx, qy, qz, qw), bool(parameters & TRACKING_VALID))


def _suffix(reader: PacketReader, version: Version) -> tuple[Stamps, int]:
    """Read the suffix. Sources disagree whether 4.0 has the precision fields: the number of remaining bytes decides."""
    precise = version >= COUNTED or (version >= ADJUSTABLE and reader.remaining >= PRECISE_SUFFIX.size)
    _, _, timestamp, exposed, _, sent, *_, parameters = reader.unpack(PRECISE_SUFFIX if precise else SUFFIX)
    return Stamps(timestamp, exposed, sent), parameters
