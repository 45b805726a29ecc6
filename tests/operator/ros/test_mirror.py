"""What the swarm publishes, as ROS 2 messages: read by rosbags."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin
from typing import Any

import pytest
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.motion import Estimate, LeaderMotion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.codec import encode
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Reason, Report, Status
from flockwire_operator.ros.mirror import Mirror
from flockwire_operator.ros.topics import DIAGNOSTIC_ARRAY, MARKER_ARRAY, SWARM_STATUS, TF, TF_STATIC, all_topics

NOW = 1_790_000_000 * SECOND
NORTH = (0.0, 0.0, sin(pi / 4), cos(pi / 4))  # its forward axis is along world y


def status(identity: str, report: Report, now: int = NOW) -> Status:
    return Status(now, "world", identity, report, 7, 0, 0, 0, 0, 0.0625, 0, (("flock/uav1/pose expired", 3),), ("a",))


def by_name(mirror: Mirror, now: int = NOW) -> dict[str, list[bytes]]:
    found: dict[str, list[bytes]] = {}
    for topic, payload in mirror.publications(now):
        found.setdefault(topic.name, []).append(payload)
    return found


def test_the_topics_are_the_drones_and_the_shared_ones(ros_plan: Callable[..., Any]) -> None:
    names = {topic.name for topic in all_topics(ros_plan())}
    for drone in ("uav0", "uav1", "uav4"):
        assert {f"/flock/{drone}/{last}" for last in ("pose", "odom", "cmd_vel", "battery")} <= names
    assert "/flock/uav1/leader_estimate" in names
    assert "/flock/uav0/leader_estimate" not in names
    assert {"/tf", "/tf_static", "/diagnostics", "/swarm/markers", "/swarm/status"} <= names
    virtual = {"leader.kind": "virtual", "drones.0": None}
    assert "/flock/uav0/cmd_vel" not in {topic.name for topic in all_topics(ros_plan(virtual))}
    assert "/lab/uav1/pose" in {topic.name for topic in all_topics(ros_plan({"ros.namespace": "/lab"}))}
    assert "/uav1/pose" in {topic.name for topic in all_topics(ros_plan({"ros.namespace": "/"}))}


def test_a_pose_is_passed_on_and_becomes_odometry_and_transform(
    ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]
) -> None:
    mirror = Mirror(ros_plan({"ros.frame_prefix": "flock/"}))
    poses = [Pose(NOW + k * SECOND // 100, "world", (0.02 * k, 0.0, 1.0), NORTH) for k in range(100)]
    for pose in poses:
        mirror.receive(Key("pose", "uav1"), pose)
    found = by_name(mirror)
    assert found["/flock/uav1/pose"] == [encode(pose) for pose in poses]
    odometry = read(found["/flock/uav1/odom"][-1], "nav_msgs/msg/Odometry")
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("world", "flock/uav1")
    assert odometry.pose.pose.position.x == poses[-1].position[0]
    velocity = odometry.twist.twist.linear  # 2 m/s along world x: to its right
    assert (velocity.x, velocity.y, velocity.z) == pytest.approx((0.0, -2.0, 0.0), abs=1e-6)
    (transforms,) = [read(data, TF.ros_type) for data in found["/tf"]]
    assert [one.child_frame_id for one in transforms.transforms] == ["flock/uav1"] * 100
    assert transforms.transforms[3].transform.rotation.z == NORTH[2]
    assert "/tf" not in by_name(mirror)  # no pose is sent twice


def test_after_a_gap_a_velocity_begins_again(ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]) -> None:
    mirror = Mirror(ros_plan())
    for pose in (Pose(NOW, "world", (0.0, 0.0, 0.0)), Pose(NOW + 2 * SECOND, "world", (9.0, 0.0, 0.0))):
        mirror.receive(Key("pose", "uav2"), pose)
    odometry = read(by_name(mirror)["/flock/uav2/odom"][-1], "nav_msgs/msg/Odometry")
    assert odometry.twist.twist.linear.x == 0.0


def test_commands_estimates_and_telemetry(ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]) -> None:
    mirror = Mirror(ros_plan())
    command = Command(NOW, "world", (0.1, 0.2, 0.3), 0.4)
    mirror.receive(Key("command", "uav3"), command)
    motion = LeaderMotion((1.0, 2.0, 3.0), (0.4, 0.5, 0.6))
    mirror.receive(Key("estimate", "uav3"), Estimate(NOW, "world", motion))
    mirror.receive(Key("telemetry", "uav3"), Telemetry(NOW, "world", FlightState.FLYING, 0.625, 1.0, 0.0))
    found = by_name(mirror)
    twist = read(found["/flock/uav3/cmd_vel"][0], "geometry_msgs/msg/TwistStamped").twist
    assert (twist.linear.y, twist.angular.z) == (0.2, 0.4)
    assert "/flock/uav3/cmd_accel" not in found
    estimate = read(found["/flock/uav3/leader_estimate"][0], "nav_msgs/msg/Odometry")
    assert (estimate.pose.pose.position.y, estimate.twist.twist.linear.x) == (2.0, 0.4)
    battery = read(found["/flock/uav3/battery"][0], "sensor_msgs/msg/BatteryState")
    assert (battery.percentage, battery.header.frame_id) == (0.625, "uav3")


def test_accelerations_of_a_law_that_commands_them(
    ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]
) -> None:
    changes = {"control": {"law": "second_order"}, "drones.3.airframe": "multirotor"}
    mirror = Mirror(ros_plan(changes))
    command = Command(NOW, "world", (0.1, 0.2, 0.3), 0.0, (1.0, 2.0, 0.0))
    for owner in ("uav2", "uav3"):
        mirror.receive(Key("command", owner), command)
    found = by_name(mirror)
    assert read(found["/flock/uav3/cmd_accel"][0], "geometry_msgs/msg/AccelStamped").accel.linear.y == 2.0
    assert "/flock/uav2/cmd_accel" not in found


def test_the_trackers_frame_is_a_static_transform_sent_once(
    ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]
) -> None:
    changes = {"gateway": {"source": "vrpn", "offset": [1.0, 2.0, 0.5], "rotation": list(NORTH)}}
    mirror = Mirror(ros_plan(changes))
    (transform,) = read(by_name(mirror)["/tf_static"][0], TF_STATIC.ros_type).transforms
    assert (transform.child_frame_id, transform.transform.translation.y) == ("tracker", 2.0)
    assert transform.transform.rotation.w == pytest.approx(NORTH[3])
    assert "/tf_static" not in by_name(mirror, NOW + SECOND)


def test_diagnostics_and_the_state_of_the_swarm(
    ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]
) -> None:
    plan = ros_plan()
    mirror = Mirror(plan)
    for identity in plan.started:
        mirror.receive(Key("status", identity), status(identity, Report(Phase.FORMATION, formation_error=0.25)))
    off = Reason("off place", "1 m off its place", "land")
    mirror.receive(Key("status", "uav1"), status("uav1", Report(Phase.FORMATION, reasons=(off,))))
    mirror.receive(Key("status", "uav2"), status("uav2", Report(Phase.STOPPED, "emergency stop"), NOW - SECOND))
    found = by_name(mirror)
    told = {one.name: one for one in read(found["/diagnostics"][0], DIAGNOSTIC_ARRAY.ros_type).status}
    assert set(told) == {f"flock: {identity}" for identity in plan.started}
    assert (told["flock: uav3"].level, told["flock: uav3"].message) == (0, "formation")
    assert (told["flock: uav1"].level, told["flock: uav1"].message) == (1, "off place: 1 m off its place: land")
    assert (told["flock: uav2"].level, told["flock: uav2"].message) == (2, "stopped: emergency stop")
    values = {one.key: one.value for one in told["flock: uav3"].values}
    assert values["formation error m"] == "0.25"
    assert values["flock/uav1/pose expired"] == "3"
    swarm = read(found["/swarm/status"][0], SWARM_STATUS.ros_type)
    assert (swarm.level, swarm.name, swarm.message) == (2, "flock", "3 of 5 drones: formation")
    later = read(by_name(mirror, NOW + 3 * SECOND)["/diagnostics"][0], DIAGNOSTIC_ARRAY.ros_type)
    assert {one.level for one in later.status} == {3}
    assert {one.message.partition(":")[0] for one in later.status} == {"silent"}


def test_diagnostics_come_once_a_second_and_at_each_change(ros_plan: Callable[..., Any]) -> None:
    mirror = Mirror(ros_plan())
    assert "/diagnostics" in by_name(mirror, NOW)
    mirror.receive(Key("status", "uav1"), status("uav1", Report(Phase.READY)))
    assert "/diagnostics" in by_name(mirror, NOW + SECOND // 100)
    times = [k for k in range(2, 300) if "/diagnostics" in by_name(mirror, NOW + k * SECOND // 100)]
    assert times == [100, 200, 201]  # it is silent from then on


def test_markers_show_drones_places_edges_errors_obstacles_and_fence(
    ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]
) -> None:
    plan = ros_plan({"obstacles": [{"center": [5.0, 5.0, 0.0], "radius": 0.25, "height": 2.0}]})
    mirror = Mirror(plan)
    for i in range(5):
        mirror.receive(Key("pose", f"uav{i}"), Pose(NOW, "world", (float(i), 0.0, 1.0)))
    order = Mission(NOW - 1, "world", "start", NOW, "")
    flying = Report(Phase.FORMATION, formation_error=0.5, mission=order)
    mirror.receive(Key("status", "uav1"), status("uav1", flying))
    mirror.receive(Key("status", "leader"), status("leader", Report(Phase.HOLD)))
    markers = read(by_name(mirror)["/swarm/markers"][0], MARKER_ARRAY.ros_type).markers
    groups: dict[str, list[Any]] = {}
    for marker in markers:
        groups.setdefault(marker.ns, []).append(marker)
    assert len(groups["drones"]) == 5
    assert {marker.text for marker in groups["names"]} >= {"uav0\nhold", "uav1\nformation 0.50 m", "uav2"}
    assert [(edge.points[0].x, edge.points[1].x) for edge in groups["edges"]] == [(0, 1), (1, 2), (2, 3), (3, 4)]
    (place,), (error,) = groups["places"], groups["errors"]  # of the one that flies a formation
    assert (place.pose.position.x, place.pose.position.y) == pytest.approx((0.0, 2.0))  # the circle's first
    assert (error.points[0].x, error.points[1].y) == pytest.approx((1.0, 2.0))
    (obstacle,) = groups["obstacles"]
    assert (obstacle.scale.x, obstacle.scale.z, obstacle.pose.position.z) == (0.5, 2.0, 1.0)
    (fence,) = groups["fence"]
    assert len(fence.points) == 24  # 12 lines of a box
    assert all((marker.lifetime.sec, marker.lifetime.nanosec) == (0, 500_000_000) for marker in markers)
