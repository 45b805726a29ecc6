"""The messages on the ROS side that are no messages of the swarm: types, their hashes, and the codec; Unix ns, m.

Source: common_interfaces, geometry2 and rcl_interfaces of ROS 2 (Humble to Lyrical agree on these), and of
motion_capture_tracking its interfaces. ROS 2 installs the hash of a type (REP 2011) with its definition, as JSON;
rosbags computes it by `hash_rihs01`.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import Final, NamedTuple

from flockwire_core.domain.pose import LEVEL, Quaternion
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.wire.cdr import HEADER, MessageError, Reader, Writer, begun

POSE = "geometry_msgs/msg/PoseStamped"
POSES = "geometry_msgs/msg/PoseArray"
NAMED_POSES = "motion_capture_tracking_interfaces/msg/NamedPoseArray"
TRANSFORM = "geometry_msgs/msg/TransformStamped"
TWIST = "geometry_msgs/msg/TwistStamped"
ACCELERATION = "geometry_msgs/msg/AccelStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
BATTERY = "sensor_msgs/msg/BatteryState"
DIAGNOSTIC = "diagnostic_msgs/msg/DiagnosticStatus"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
MARKERS = "visualization_msgs/msg/MarkerArray"
CLOCK = "rosgraph_msgs/msg/Clock"
TRIGGER = "std_srvs/srv/Trigger"

HASHES = {  # part of each key of rmw_zenoh
    POSE: "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    POSES: "RIHS01_af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0",
    NAMED_POSES: "RIHS01_d4c89ff7e0670d5f83b0322513e1c8dc2c3b279a68495daa026c352f0027e5f2",
    TRANSFORM: "RIHS01_0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206",
    TWIST: "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    ACCELERATION: "RIHS01_ef1df9eabae0a708cc049a061ebcddc4e2a5f745730100ba680e086a9698b165",
    ODOMETRY: "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    TRANSFORMS: "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    BATTERY: "RIHS01_4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
    DIAGNOSTIC: "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
    DIAGNOSTICS: "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    MARKERS: "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    CLOCK: "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    TRIGGER: "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
}

OK, WARN, ERROR, STALE = 0, 1, 2, 3  # levels of a diagnostic status
UNKNOWN: Final = float("nan")
DISCHARGING, LITHIUM_POLYMER = 2, 3  # sensor_msgs/BatteryState
POSE_TYPES: Final = (POSE, TRANSFORM, POSES, NAMED_POSES, TRANSFORMS)
UNKNOWN_COVARIANCE: Final = (0.0,) * 36  # by the message's convention

Colour = tuple[float, float, float, float]  # red, green, blue, opacity, each 0 to 1


class NamedPose(NamedTuple):
    """The pose of a body, or of a frame, at `stamp`, in `frame`; its name is empty if a message has none."""

    stamp: int
    name: str
    position: Vector
    orientation: Quaternion
    frame: str = ""


class DiagnosticStatus(NamedTuple):
    """diagnostic_msgs/DiagnosticStatus: the state of one component."""

    level: int
    name: str
    message: str
    hardware: str
    values: tuple[tuple[str, str], ...]


class Shape(IntEnum):
    """The shape of a marker, by its number in ROS."""

    ARROW = 0
    SPHERE = 2
    CYLINDER = 3
    LINE_LIST = 5
    TEXT = 9


class Marker(NamedTuple):
    """One thing to draw: `scale` is its size, m (of lines: x, their width; of text: z, its height)."""

    group: str  # RViz shows and hides whole groups
    number: int  # within the group
    shape: Shape
    colour: Colour
    scale: Vector
    position: Vector = ZERO
    points: tuple[Vector, ...] = ()
    text: str = ""


def derivative(stamp: int, frame: str, linear: Vector, angular: Vector = ZERO) -> bytes:
    """Return a geometry_msgs/TwistStamped (m/s, rad/s) or AccelStamped (m/s^2, rad/s^2): they have one layout."""
    writer = begun(stamp, frame)
    writer.vector(linear)
    writer.vector(angular)
    return writer.finish()


def odometry(stamp: int, frame: str, child: str, position: Vector, orientation: Quaternion, velocity: Vector) -> bytes:
    """Return a nav_msgs/Odometry: the pose of `child` in `frame`, and its velocity (m/s) in `child`."""
    writer = begun(stamp, frame)
    writer.text(child)
    writer.put_all("d", *position, *orientation, *UNKNOWN_COVARIANCE, *velocity, *ZERO, *UNKNOWN_COVARIANCE)
    return writer.finish()


def transforms(frame: str, poses: Sequence[NamedPose]) -> bytes:
    """Return a tf2_msgs/TFMessage: the poses of other frames in `frame`."""
    writer = Writer()
    writer.unsigned(len(poses))
    for stamp, name, position, orientation, _ in poses:
        writer.time(stamp)
        writer.text(frame)
        writer.text(name)
        writer.vector(position)
        writer.quaternion(orientation)
    return writer.finish()


def pose_array(stamp: int, frame: str, poses: Sequence[tuple[Vector, Quaternion]]) -> bytes:
    """Return a geometry_msgs/PoseArray."""
    writer = begun(stamp, frame)
    writer.unsigned(len(poses))
    if poses:
        writer.put_all("d", *(x for pose in poses for part in pose for x in part))
    return writer.finish()


def battery(stamp: int, frame: str, share: float) -> bytes:
    """Return a sensor_msgs/BatteryState with the charge as a `share` of full; what is not measured is NaN."""
    writer = begun(stamp, frame)
    writer.put_all("f", *[UNKNOWN] * 6, share)
    writer.put_all("B", DISCHARGING, 0, LITHIUM_POLYMER, 1)
    writer.put_all("I", 0, 0)  # voltages and temperatures of cells
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
    writer = begun(stamp, "")
    writer.unsigned(len(statuses))
    for status in statuses:
        _write_diagnostic(writer, status)
    return writer.finish()


def clock_reading(stamp: int) -> bytes:
    """Return a rosgraph_msgs/Clock."""
    writer = Writer()
    writer.time(stamp)
    return writer.finish()


def trigger_response(success: bool, message: str) -> bytes:
    """Return the response of a std_srvs/Trigger."""
    writer = Writer()
    writer.byte(int(success))
    writer.text(message)
    return writer.finish()


def marker_array(stamp: int, frame: str, markers: Sequence[Marker], lifetime: float) -> bytes:
    """Return a visualization_msgs/MarkerArray: each is drawn for `lifetime` s, unless it comes again."""
    writer = Writer()
    writer.unsigned(len(markers))
    for marker in markers:
        writer.time(stamp)
        writer.text(frame)
        writer.text(marker.group)
        writer.put_all("i", marker.number, marker.shape, 0)  # added or changed
        writer.put_all("d", *marker.position, *LEVEL, *marker.scale)
        writer.put_all("f", *marker.colour)
        writer.put_all("i", int(lifetime), int(lifetime % 1.0 * 1e9))
        writer.byte(0)  # not locked to its frame
        writer.unsigned(len(marker.points))
        if marker.points:
            writer.put_all("d", *(x for point in marker.points for x in point))
        writer.unsigned(0)  # colours of points
        writer.text("")  # texture
        writer.time(0)
        for text in ("", ""):  # the texture's frame and format
            writer.text(text)
        writer.put_all("I", 0, 0)  # the texture's data, and its coordinates
        for text in (marker.text, "", ""):  # text, mesh, and the file of the mesh
            writer.text(text)
        writer.unsigned(0)  # its data
        writer.byte(0)
    return writer.finish()


def check_empty(data: bytes) -> None:
    """Check a message without fields, as the request of a std_srvs/Trigger is; raises MessageError."""
    # bytes of a message without fields: the header, one byte, and padding
    if data[:4] != HEADER or len(data) > 8 or any(data[4:]):
        raise MessageError(f"{len(data)} bytes are not an empty message")


def read_poses(ros_type: str, data: bytes) -> list[NamedPose]:
    """Return the bodies in a message of one of the types of poses (`POSE_TYPES`); raises MessageError."""
    reader, found = Reader(data), list[NamedPose]()
    many, named = ros_type in (POSES, NAMED_POSES), ros_type not in (POSE, POSES)
    for _ in range(reader.length() if ros_type == TRANSFORMS else 1):
        stamp, frame = reader.time(), reader.text()
        for _ in range(reader.length() if many else 1):
            name = reader.text() if named else ""
            x, y, z, qx, qy, qz, qw = reader.take_all("d", 7)
            name = name if many else name.removeprefix("/")  # of a frame, as early tf has it
            found.append(NamedPose(stamp, name, (x, y, z), (qx, qy, qz, qw), frame))
    reader.end()
    return found


def _write_diagnostic(writer: Writer, status: DiagnosticStatus) -> None:
    writer.byte(status.level)
    for text in (status.name, status.message, status.hardware):
        writer.text(text)
    writer.texts(tuple([text for pair in status.values for text in pair]), 2)
