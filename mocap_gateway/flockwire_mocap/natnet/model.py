"""The model definition: the names of rigid bodies; all other descriptions are skipped.

Layout: i32 count of descriptions; each an i32 type, from 4.1 on a u32 size in bytes, and the description. From 4.1 on
only the size is used. Before, an unknown type ends the reading, and the descriptions read so far are kept.
"""

from __future__ import annotations

from struct import Struct

from flockwire_mocap.natnet.packets import ADJUSTABLE, COUNTED, ModelDefinition, Version
from flockwire_mocap.natnet.reader import TEXT, Layout, MalformedError, PacketReader

RIGID_BODY_TYPE, SKELETON_TYPE = 1, 2
_SIZE = Struct("<I")
_OTHERS: dict[int, Layout] = {  # by type
    0: (TEXT, (TEXT,)),  # a marker set
    3: (4, TEXT, 4 * (2 + 3 + 144 + 12 + 2), (TEXT,)),  # a force plate: size, origin, 12 x 12, 4 corners, two types
    4: (4, TEXT, TEXT, 8, (TEXT,)),  # a device
    5: (TEXT, 12 + 16),  # a camera: x y z, quaternion
}


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
        names.update([_read_body(reader, version)])
    elif kind == SKELETON_TYPE:
        _read_head(reader)
        for _ in range(reader.count(25)):
            _read_body(reader, version)
    elif kind in _OTHERS:
        reader.pass_over(_OTHERS[kind])
    else:
        raise MalformedError(f"a description of type {kind}")


def _read_head(reader: PacketReader) -> tuple[int, str]:
    name = reader.text()
    return reader.integer(), name


def _read_body(reader: PacketReader, version: Version) -> tuple[int, str]:
    """Read a rigid body: name, id, parent's id, offset, its markers' offsets, labels and (from 4.0) names."""
    head = _read_head(reader)
    reader.skip(4 + 12)
    markers = reader.count(12 + 4)
    reader.skip(markers * (12 + 4))
    if version >= ADJUSTABLE:
        reader.pass_over((TEXT,) * markers)
    return head
