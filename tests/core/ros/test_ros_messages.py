"""The messages on the ROS side: read by rosbags, they have what was written; hashes are those of rosbags."""

from __future__ import annotations

from math import isnan
from typing import Any

import pytest
from flockwire_core.ros import messages
from flockwire_core.ros.messages import HASHES, TRIGGER, Marker, Shape, marker_array
from flockwire_core.wire.cdr import MessageError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

NOW = 1_790_000_000_123_456_789
NAMES = ("", "a", "ab", "abc", "abcd", "uav1", "a longer name")
STANDARD = [name for name in HASHES if name != TRIGGER]
STORE = get_typestore(Stores.ROS2_JAZZY)
RESPONSE = "std_srvs/msg/TriggerResponse"
STORE.register(get_types_from_msg("bool success\nstring message", RESPONSE))
MOTION_CAPTURE = {  # as motion_capture_tracking_interfaces has them
    "motion_capture_tracking_interfaces/msg/NamedPose": "string name\ngeometry_msgs/Pose pose",
    "motion_capture_tracking_interfaces/msg/NamedPoseArray": "std_msgs/Header header\nNamedPose[] poses",
}
for _name, _text in MOTION_CAPTURE.items():
    STORE.register(get_types_from_msg(_text, _name))


def read(data: bytes, ros_type: str) -> Any:
    return STORE.deserialize_cdr(data, ros_type)


@pytest.mark.parametrize("store", [Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY, Stores.LATEST])
def test_hashes_are_those_of_rosbags(store: Stores) -> None:
    types = get_typestore(store)
    for name, text in MOTION_CAPTURE.items():
        types.register(get_types_from_msg(text, name))
    assert {name: HASHES[name] for name in STANDARD} == {name: types.hash_rihs01(name) for name in STANDARD}


def test_the_hash_of_the_service_is_that_of_ros_itself() -> None:
    # std_srvs/Trigger as natnet_zenoh pins it from Jazzy
    assert HASHES[TRIGGER] == "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"


@pytest.mark.parametrize("frame", NAMES)
@pytest.mark.parametrize("child", NAMES)
def test_odometry_and_transforms(frame: str, child: str) -> None:
    data = messages.odometry(NOW, frame, child, (1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8), (4.0, 5.0, 6.0))
    found = read(data, messages.ODOMETRY)
    assert STORE.serialize_cdr(found, messages.ODOMETRY) == data
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == divmod(NOW, 10**9)
    assert (found.header.frame_id, found.child_frame_id) == (frame, child)
    assert (found.pose.pose.position.y, found.pose.pose.orientation.w, found.twist.twist.linear.z) == (2.0, 0.8, 6.0)
    poses = [messages.NamedPose(NOW + k, child + str(k) * k, (k, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8)) for k in range(3)]
    data = messages.transforms(frame, poses)
    found = read(data, messages.TRANSFORMS)
    assert STORE.serialize_cdr(found, messages.TRANSFORMS) == data
    assert [one.child_frame_id for one in found.transforms] == [pose.name for pose in poses]
    assert [one.transform.translation.x for one in found.transforms] == [0.0, 1.0, 2.0]
    assert found.transforms[2].transform.rotation.z == 0.6


def test_battery() -> None:
    data = messages.battery(NOW, "uav1", 0.5)
    found = read(data, messages.BATTERY)
    assert STORE.serialize_cdr(found, messages.BATTERY) == data
    assert (found.percentage, found.present, found.header.frame_id) == (0.5, True, "uav1")
    assert isnan(found.voltage)
    assert isnan(found.design_capacity)


def test_diagnostics() -> None:
    status = messages.DiagnosticStatus(messages.WARN, "flock: uav1", "ready", "uav1", (("a", "1"), ("bc", "é")))
    found = read(messages.diagnostics(NOW, [status, status]), messages.DIAGNOSTICS)
    assert [one.name for one in found.status] == ["flock: uav1"] * 2
    one = read(messages.diagnostic(status), messages.DIAGNOSTIC)
    assert (one.level, one.message, one.hardware_id) == (messages.WARN, "ready", "uav1")
    assert [(value.key, value.value) for value in one.values] == [("a", "1"), ("bc", "é")]


def test_markers() -> None:
    lines = Marker("fence", 3, Shape.LINE_LIST, (1.0, 0.5, 0.0, 1.0), (0.02, 0.0, 0.0), points=((1.0, 2.0, 3.0),) * 2)
    text = Marker("names", 1, Shape.TEXT, (1.0,) * 4, (0.0, 0.0, 0.2), (1.0, 2.0, 3.0), text="uav1")
    data = marker_array(NOW, "world", [lines, text, lines], 0.5)
    found = read(data, messages.MARKERS)
    assert STORE.serialize_cdr(found, messages.MARKERS) == data
    assert [(one.ns, one.id, one.type) for one in found.markers] == [("fence", 3, 5), ("names", 1, 9), ("fence", 3, 5)]
    assert found.markers[0].points[1].z == 3.0
    assert found.markers[1].text == "uav1"
    assert (found.markers[1].lifetime.sec, found.markers[1].lifetime.nanosec) == (0, 500_000_000)


def test_clock_and_trigger() -> None:
    assert read(messages.clock_reading(NOW), messages.CLOCK).clock.nanosec == 123_456_789
    response = messages.trigger_response(False, "not confirmed by uav3")
    found = read(response, RESPONSE)
    assert (found.success, found.message) == (False, "not confirmed by uav3")
    messages.check_empty(b"\0\1\0\0\0")
    for wrong in (b"", b"\0\1\0\0\1", b"\0\0\0\0\0", b"\0\1\0\0" + bytes(5)):
        with pytest.raises(MessageError):
            messages.check_empty(wrong)


def test_poses_of_rosbags_are_read_and_others_refused() -> None:
    types = STORE.types
    pose = types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](1.0, 2.0, 3.0), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.6, 0.8)
    )
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](5, 7), "map")
    data = bytes(STORE.serialize_cdr(types[messages.POSES](header, [pose, pose]), messages.POSES))
    one = messages.NamedPose(5_000_000_007, "", (1.0, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8), "map")
    assert messages.read_poses(messages.POSES, data) == [one, one]
    named = [types["motion_capture_tracking_interfaces/msg/NamedPose"](name, pose) for name in ("a", "drone 12")]
    array = types[messages.NAMED_POSES](header, named)
    found = messages.read_poses(messages.NAMED_POSES, bytes(STORE.serialize_cdr(array, messages.NAMED_POSES)))
    assert found == [one._replace(name="a"), one._replace(name="drone 12")]
    transform = types["geometry_msgs/msg/TransformStamped"](
        header,
        "/cf1",
        types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](1.0, 2.0, 3.0), pose.orientation),
    )
    single = bytes(STORE.serialize_cdr(transform, messages.TRANSFORM))
    assert messages.read_poses(messages.TRANSFORM, single) == [one._replace(name="cf1")]
    several = bytes(STORE.serialize_cdr(types[messages.TRANSFORMS]([transform] * 2), messages.TRANSFORMS))
    assert messages.read_poses(messages.TRANSFORMS, several) == [one._replace(name="cf1")] * 2
    for length in range(len(data) - 4):
        with pytest.raises(MessageError):
            messages.read_poses(messages.POSES, data[:length])
