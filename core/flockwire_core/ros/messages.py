"""The codec of the messages on the ROS side that are no messages of the swarm; times are Unix ns, lengths m."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from struct import Struct
from typing import Final, NamedTuple

from flockwire_core.domain.quaternion import Quaternion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.ros.definitions import NAMED_POSES, POSE, POSES, TRANSFORM, TRANSFORMS
from flockwire_core.wire.cdr import HEADER, MessageError, Reader, Writer

OK, WARN, ERROR, STALE = 0, 1, 2, 3  # levels of a diagnostic status
UNKNOWN: Final = float("nan")
DISCHARGING, LITHIUM_POLYMER = 2, 3  # sensor_msgs/BatteryState
_CLOCK: Final = Struct("<4siI")
_LARGEST_EMPTY = 8  # bytes of a message without fields: the header, one byte, and padding


class Transform(NamedTuple):
    """The pose of the frame `child` at `stamp`."""

    stamp: int
    child: str
    position: Vector
    orientation: Quaternion


class Sighting(NamedTuple):
    """A body in a message of poses: its name (empty if the message has none) and its pose in `frame` at `stamp`."""

    stamp: int
    frame: str
    name: str
    position: Vector
    orientation: Quaternion


class DiagnosticStatus(NamedTuple):
    """diagnostic_msgs/DiagnosticStatus: the state of one component."""

    level: int
    name: str
    message: str
    hardware: str
    values: tuple[tuple[str, str], ...]


@lru_cache(maxsize=256)
def _odometry(frame: int, child: int) -> Struct:
    """Return the struct of an odometry with names of so many bytes; covariances are zero, which means unknown."""
    at = 12 + frame
    padding = -at % 4
    at += padding + 4 + child
    return Struct(f"<4siII{frame}s{padding}xI{child}s{-at % 8}x7d288x6d288x")


def odometry(stamp: int, frame: str, child: str, position: Vector, orientation: Quaternion, velocity: Vector) -> bytes:
    """Return a nav_msgs/Odometry: the pose of `child` in `frame`, and its velocity (m/s) in `child`."""
    above, below = frame.encode() + b"\0", child.encode() + b"\0"
    return _odometry(len(above), len(below)).pack(
        HEADER, stamp // SECOND, stamp % SECOND, len(above), above, len(below), below,
        *position, *orientation, *velocity, *ZERO,
    )  # fmt: skip


@lru_cache(maxsize=256)
def _transforms(frame: int, children: tuple[int, ...]) -> Struct:
    """Return the struct of transforms with names of so many bytes."""
    at, parts = 4, ["<4sI"]
    for child in children:
        before = -at % 4
        at += before + 12 + frame
        between = -at % 4
        at += between + 4 + child
        last = -at % 8
        at += last + 56
        parts.append(f"{before}xiII{frame}s{between}xI{child}s{last}x7d")
    return Struct("".join(parts))


def transforms(frame: str, poses: Sequence[Transform]) -> bytes:
    """Return a tf2_msgs/TFMessage: the poses of other frames in `frame`."""
    above = frame.encode() + b"\0"
    values: list[object] = []
    lengths: list[int] = []
    for stamp, child, position, orientation in poses:
        below = child.encode() + b"\0"
        lengths.append(len(below))
        values += (stamp // SECOND, stamp % SECOND, len(above), above, len(below), below, *position, *orientation)
    return _transforms(len(above), tuple(lengths)).pack(HEADER, len(poses), *values)


def pose_array(stamp: int, frame: str, poses: Sequence[tuple[Vector, Quaternion]]) -> bytes:
    """Return a geometry_msgs/PoseArray."""
    writer = _stamped(stamp, frame)
    writer.put("I", len(poses))
    if poses:
        writer.put_all("d", *(x for pose in poses for part in pose for x in part))
    return writer.finish()


def battery(stamp: int, frame: str, share: float) -> bytes:
    """Return a sensor_msgs/BatteryState with the charge as a `share` of full; what is not measured is NaN."""
    writer = _stamped(stamp, frame)
    writer.put_all("f", *[UNKNOWN] * 6, share)
    writer.put_all("B", DISCHARGING, 0, LITHIUM_POLYMER, 1)
    for _ in range(2):  # voltages and temperatures of cells
        writer.put("I", 0)
    for text in ("", ""):  # location, serial number
        writer.text(text)
    return writer.finish()


def diagnostic(status: DiagnosticStatus) -> bytes:
    """Return a diagnostic_msgs/DiagnosticStatus."""
    writer = Writer()
    _write_diagnostic(writer, status)
    return writer.finish()


def diagnostics(stamp: int, statuses: Sequence[DiagnosticStatus]) -> bytes:
    """Return a diagnostic_msgs/DiagnosticArray."""
    writer = _stamped(stamp, "")
    writer.put("I", len(statuses))
    for status in statuses:
        _write_diagnostic(writer, status)
    return writer.finish()


def clock_reading(stamp: int) -> bytes:
    """Return a rosgraph_msgs/Clock."""
    return _CLOCK.pack(HEADER, stamp // SECOND, stamp % SECOND)


def trigger_response(success: bool, message: str) -> bytes:
    """Return the response of a std_srvs/Trigger."""
    writer = Writer()
    writer.put("B", success)
    writer.text(message)
    return writer.finish()


def check_empty(data: bytes) -> None:
    """Check a message without fields, as the request of a std_srvs/Trigger is; raises MessageError."""
    if data[:4] != HEADER or len(data) > _LARGEST_EMPTY or any(data[4:]):
        raise MessageError(f"{len(data)} bytes are not an empty message")


def read_sightings(ros_type: str, data: bytes) -> list[Sighting]:
    """Return the bodies in a message of one of the types of poses (`SIGHTINGS`); raises MessageError."""
    reader = Reader(data)
    found = SIGHTINGS[ros_type](reader)
    reader.end()
    return found


def _one_pose(reader: Reader) -> list[Sighting]:
    return [_sighting(reader, reader.time(), reader.text())]


def _poses(reader: Reader) -> list[Sighting]:
    stamp, frame = reader.time(), reader.text()
    return [_sighting(reader, stamp, frame) for _ in range(reader.length())]


def _named_poses(reader: Reader) -> list[Sighting]:
    stamp, frame = reader.time(), reader.text()
    return [_sighting(reader, stamp, frame, reader.text()) for _ in range(reader.length())]


def _one_transform(reader: Reader) -> list[Sighting]:
    return [_sighting(reader, reader.time(), reader.text(), reader.text().removeprefix("/"))]


def _transforms_in(reader: Reader) -> list[Sighting]:
    return [one for _ in range(reader.length()) for one in _one_transform(reader)]


def _sighting(reader: Reader, stamp: int, frame: str, name: str = "") -> Sighting:
    x, y, z, qx, qy, qz, qw = reader.take_all("d", 7)
    return Sighting(stamp, frame, name, (x, y, z), (qx, qy, qz, qw))


SIGHTINGS: Mapping[str, Callable[[Reader], list[Sighting]]] = {
    POSE: _one_pose,
    TRANSFORM: _one_transform,
    POSES: _poses,
    NAMED_POSES: _named_poses,
    TRANSFORMS: _transforms_in,
}


def _stamped(stamp: int, frame: str) -> Writer:
    writer = Writer()
    writer.time(stamp)
    writer.text(frame)
    return writer


def _write_diagnostic(writer: Writer, status: DiagnosticStatus) -> None:
    writer.put("B", status.level)
    for text in (status.name, status.message, status.hardware):
        writer.text(text)
    writer.texts(tuple([text for pair in status.values for text in pair]), 2)
