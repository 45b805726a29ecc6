"""The model definition: the names of rigid bodies; all other descriptions are skipped.

Layout: i32 count of descriptions; each an i32 type, from 4.1 on a u32 size in bytes, and the description. From 4.1 on
only the size is used. Before, an unknown type ends the reading, and the descriptions read so far are kept.
"""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct

from flockwire_mocap.natnet.packets import ADJUSTABLE, COUNTED, TURNED, BodyDescription, ModelDefinition, Version
from flockwire_mocap.natnet.reader import MalformedError, PacketReader

RIGID_BODY_TYPE = 1
_SIZE = Struct("<I")
_POSITION, _TURN = 12, 16  # bytes of an offset x y z and of a quaternion
_CAMERA = _POSITION + _TURN


def read_model(reader: PacketReader, version: Version) -> ModelDefinition:
    """Read the body of a model definition; raises MalformedError if not even the count of descriptions is there."""
    bodies: list[BodyDescription] = []
    for _ in range(reader.count(8 if version >= COUNTED else 4)):
        try:
            body = _read_description(reader, version)
        except MalformedError:
            return ModelDefinition(tuple(bodies), complete=False)
        if body is not None:
            bodies.append(body)
    return ModelDefinition(tuple(bodies), complete=True)


def _read_description(reader: PacketReader, version: Version) -> BodyDescription | None:
    kind = reader.integer()
    if version >= COUNTED:
        part = reader.part(reader.unpack(_SIZE)[0])
        return _read_body_head(part) if kind == RIGID_BODY_TYPE else None
    if kind == RIGID_BODY_TYPE:
        return _read_body(reader, version)
    if kind not in _PASS_OVER:
        raise MalformedError(f"a description of type {kind}")
    _PASS_OVER[kind](reader, version)
    return None


def _read_body_head(reader: PacketReader) -> BodyDescription:
    name = reader.text()
    return BodyDescription(reader.integer(), name)


def _read_body(reader: PacketReader, version: Version) -> BodyDescription:
    """Read a rigid body: name, id, parent's id, offset, its markers' offsets, labels and (from 4.0) names."""
    body = _read_body_head(reader)
    reader.skip(4 + _POSITION + (_TURN if version >= TURNED else 0))
    markers = reader.count(_POSITION + 4)
    reader.skip(markers * (_POSITION + 4))
    if version >= ADJUSTABLE:
        _skip_texts(reader, markers)
    return body


def _skip_texts(reader: PacketReader, count: int) -> None:
    for _ in range(count):
        reader.text()


def _skip_marker_set(reader: PacketReader, version: Version) -> None:
    reader.text()
    _skip_texts(reader, reader.count(1))


def _skip_skeleton(reader: PacketReader, version: Version) -> None:
    _read_body_head(reader)
    for _ in range(reader.count(25)):
        _read_body(reader, version)


def _skip_force_plate(reader: PacketReader, version: Version) -> None:
    reader.integer()
    reader.text()
    reader.skip(4 * (2 + 3 + 144 + 12 + 2))  # width, length, origin, 12 x 12 calibration, 4 corners, type, type of data
    _skip_texts(reader, reader.count(1))


def _skip_device(reader: PacketReader, version: Version) -> None:
    reader.integer()
    _skip_texts(reader, 2)
    reader.skip(8)
    _skip_texts(reader, reader.count(1))


def _skip_camera(reader: PacketReader, version: Version) -> None:
    reader.text()
    reader.skip(_CAMERA)


_PASS_OVER: dict[int, Callable[[PacketReader, Version], None]] = {
    0: _skip_marker_set,
    2: _skip_skeleton,
    3: _skip_force_plate,
    4: _skip_device,
    5: _skip_camera,
}
