"""Poses from ROS topics: frames as from any tracker; what is no pose is dropped and counted; why none arrive."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.ros.graph import End, advice, dds_type
from flockwire_core.ros.messages import (
    HASHES,
    NAMED_POSES,
    ODOMETRY,
    POSE,
    POSES,
    TRANSFORM,
    TRANSFORMS,
    NamedPose,
    pose_array,
    transforms,
)
from flockwire_core.wire.cdr import Writer
from flockwire_core.wire.codec import encode
from flockwire_core.wire.plan import Plan
from flockwire_mocap.body_names import SINGLE
from flockwire_mocap.ros import MOST_BODIES, NO_STAMP, OWNED, SAME, UNSET, RosSource

NOW = 1_790_000_000 * SECOND
LEVEL = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def source(make_plan: Callable[..., Plan]) -> Callable[..., RosSource]:
    """Return the builder of a source; its table [gateway.ros] has `options`."""

    def make(**options: Any) -> RosSource:
        plan = make_plan({"gateway": {"source": "ros", "ros": options}})
        return RosSource(Start(plan, "gateway", NOW, Random(0)))

    return make


def pose(stamp: int, x: float = 0.0, orientation: tuple[float, ...] = LEVEL) -> bytes:
    return encode(Pose(stamp, "mocap", (x, 0.0, 1.0), orientation))


def names(source: RosSource, now: int = NOW) -> list[str | None]:
    return [body.name for frame in source.take(now) for body in frame.bodies if body.tracked]


def test_a_frame_is_complete_when_all_drones_have_a_pose(source: Callable[..., RosSource]) -> None:
    ros = source(topic="/vrpn_mocap/{body}/pose")
    assert (ros.topic, ros.shown[1]) == ("/vrpn_mocap/*/pose", "/vrpn_mocap/uav1/pose")
    for i in range(5):
        assert not ros.complete()
        ros.message(f"/vrpn_mocap/uav{i}/pose", POSE, pose(1000, float(i)), NOW)
    assert ros.complete()
    (frame,) = ros.take(NOW + 5)
    assert frame.captured == NOW  # the clock of the ROS side is mapped to the gateway's
    assert [(body.name, body.position[0]) for body in frame.bodies] == [(f"uav{i}", float(i)) for i in range(5)]
    assert not ros.complete()


def test_axes_units_and_latency_are_those_of_the_table(source: Callable[..., RosSource]) -> None:
    ros = source(up_axis="y", unit="mm", latency=0.005)
    ros.message("/vrpn_mocap/uav1/pose", POSE, encode(Pose(1000, "m", (1000.0, 2000.0, 3000.0), LEVEL)), NOW)
    (frame,) = ros.take(NOW)
    assert frame.captured == NOW - 5_000_000
    assert frame.bodies[0].position == pytest.approx((1.0, -3.0, 2.0))


def test_a_body_that_the_file_does_not_name_is_seen_too_but_only_so_many(source: Callable[..., RosSource]) -> None:
    ros = source()
    ros.message("/vrpn_mocap/person/pose", POSE, pose(1000), NOW)
    assert names(ros) == ["person"]
    for k in range(MOST_BODIES):
        ros.message(f"/vrpn_mocap/b{k}/pose", POSE, pose(1000), NOW)
    assert ros.counts == {"poses of too many bodies": 6}  # five drones and the person came before
    for name in ("x" * 256, "\x1b[2J", "a b", "a/b", ""):  # anybody can publish on any key
        ros.message(f"/vrpn_mocap/{name}/pose", POSE, pose(1000), NOW)
    assert ros.counts["poses of a name that ROS does not have"] == 5


def test_an_array_has_all_bodies_in_the_order_of_the_file(source: Callable[..., RosSource]) -> None:
    ros = source(array="/poses", bodies=["uav4", "uav0", "uav1", "uav2", "uav3", "cart"])
    poses = [((float(k), 0.0, 1.0), LEVEL) for k in range(6)]
    poses[2] = ((float("nan"),) * 3, LEVEL)
    ros.message("/poses", POSES, pose_array(1000, "mocap", poses), NOW)
    assert ros.complete()
    (frame,) = ros.take(NOW)
    seen = {body.name: body.position[0] for body in frame.bodies if body.tracked}
    assert seen == {"uav4": 0.0, "uav0": 1.0, "uav2": 3.0, "uav3": 4.0, "cart": 5.0}
    ros.message("/poses", POSES, pose_array(2000, "mocap", poses[:5]), NOW)
    assert not ros.complete()
    assert ros.counts == {"arrays of another length": 1}
    assert ros.state(NOW).trouble.startswith("waits for the router")
    ros.failure = ""
    assert ros.state(NOW + SECOND).trouble == "/poses has 5 poses, but 6 bodies are expected: set gateway.ros.bodies"


def test_what_is_no_pose_or_no_news_is_dropped_and_counted(source: Callable[..., RosSource]) -> None:
    ros, topic = source(), "/vrpn_mocap/uav1/pose"
    ros.message(topic, POSE, pose(5 * SECOND), NOW)
    assert names(ros) == ["uav1"]
    good = pose(6 * SECOND)
    for payload in (b"", good[:-1], good[:20], b"\xff" * 84):
        ros.message(topic, POSE, payload, NOW)
    ros.message(topic, POSE, pose(7 * SECOND, orientation=(0.0, 0.0, 0.0, 2.0)), NOW)
    for stamp in (5 * SECOND, 5 * SECOND - 1, 0):
        ros.message(topic, POSE, pose(stamp), NOW)
    assert names(ros) == []
    dropped = {"poses repeated or late": 2, "poses without a stamp": 1}
    assert dict(ros.state(NOW).counts) == {"poses malformed": 4, "poses rejected": 1} | dropped
    ros.message(topic, POSE, pose(1 * SECOND), NOW)  # the driver was restarted, or its clock set back
    assert names(ros) == ["uav1"]


@pytest.mark.parametrize(
    ("ends", "says"),
    [
        ([], "no node publishes /m/*/pose: check its name with `ros2 topic list`"),
        ([(0, "/m/a/b/pose", POSE)], "no node publishes /m/*/pose: check its name with `ros2 topic list`"),
        ([(3, "/m/a/pose", POSE)], "/m/a/pose is published in domain 3: set the.key"),
        (
            [(0, "/m/a/pose", ODOMETRY)],
            "must be of geometry_msgs::msg::dds_::PoseStamped_ or geometry_msgs::msg::dds_::TransformStamped_",
        ),
        ([(0, "/m/a/pose", None)], "another version of geometry_msgs::msg::dds_::PoseStamped_"),
        ([(3, "/m/a/pose", POSE), (0, "/m/b/pose", POSE)], "/driver announces /m/b/pose, but publishes nothing"),
    ],
)
def test_why_nothing_arrives_is_one_line_with_the_remedy(ends: list[tuple[int, str, str | None]], says: str) -> None:
    found = [
        End(domain, "MP", "/driver", name, dds_type(kind or POSE), HASHES[kind] if kind else "TypeHashNotSupported")
        for domain, name, kind in ends
    ]
    assert says in advice(found, 0, "/m/*/pose", SINGLE, "the.key")


def named_poses(stamp: int, *names: str) -> bytes:
    writer = Writer()
    writer.time(stamp)
    writer.text("world")
    writer.unsigned(len(names))
    for k, name in enumerate(names):
        writer.text(name)
        writer.put_all("d", float(k), 0.0, 1.0, *LEVEL)
    return writer.finish()


def transformed(stamp: int, frame: str, *names: str) -> bytes:
    return transforms(frame, [NamedPose(stamp, name, (float(k), 0.0, 1.0), LEVEL) for k, name in enumerate(names)])


def test_named_poses_have_their_names_in_any_order_and_number(source: Callable[..., RosSource]) -> None:
    ros = source(array="/poses")
    ros.message("/poses", NAMED_POSES, named_poses(1000, "uav3", "cart", "uav1"), NOW)
    assert ros.complete()
    (frame,) = ros.take(NOW)
    assert {body.name: body.position[0] for body in frame.bodies} == {"uav3": 0.0, "cart": 1.0, "uav1": 2.0}
    ros.message("/poses", NAMED_POSES, named_poses(2000, "\x1b[2J"), NOW)
    assert names(ros) == []


def test_a_transform_is_of_the_body_of_its_topic_that_may_be_named_twice(source: Callable[..., RosSource]) -> None:
    ros = source(topic="/vicon/{body}/{body}")
    writer = Writer()
    writer.time(1000)
    for text in ("world", "vicon/uav1/uav1"):
        writer.text(text)
    writer.put_all("d", 0.0, 0.0, 1.0, *LEVEL)
    payload = writer.finish()
    ros.message("/vicon/uav1/uav1", TRANSFORM, payload, NOW)
    ros.message("/vicon/uav1/uav2", TRANSFORM, payload, NOW)
    assert names(ros) == ["uav1"]


def test_transforms_of_the_drones_frame_are_bodies_and_parts_of_robots_are_not(
    source: Callable[..., RosSource],
) -> None:
    ros = source(array="/tf")
    ros.message("/tf", TRANSFORMS, transformed(1000, "arm", "hand"), NOW, b"robot")
    assert names(ros) == []
    for k in range(5):  # a driver may send each body on its own
        assert not ros.complete()
        ros.message("/tf", TRANSFORMS, transformed(1000, "world", f"uav{k}"), NOW, b"driver")
    assert ros.complete()
    ros.message("/tf", TRANSFORMS, transformed(2000, "world", "person"), NOW, b"driver")
    ros.message("/tf", TRANSFORMS, transformed(2000, "arm", "hand"), NOW, b"robot")
    assert names(ros) == ["uav0", "uav1", "uav2", "uav3", "uav4", "person"]


AHEAD = [0.2, 1.1, 1e8, -0.2, -5.0]


@pytest.mark.parametrize("seconds", AHEAD)
@pytest.mark.parametrize("body", ["person", "uav1"])
def test_a_publisher_with_another_clock_moves_no_drone(
    source: Callable[..., RosSource], seconds: float, body: str
) -> None:
    ros, ages = source(), list[int]()
    for k in range(300):
        now = NOW + k * SECOND // 100
        for i in range(5):
            ros.message(f"/vrpn_mocap/uav{i}/pose", POSE, pose(now - 5, float(i)), now, bytes([i]))
        if k >= 100:
            stamp = now + round(seconds * SECOND)
            ros.message(f"/vrpn_mocap/{body}/pose", POSE, pose(stamp, 9.0), now, b"another")
        for frame in ros.take(now):
            found = {one.name: one.position[0] for one in frame.bodies if one.name != "person"}
            assert all(name == f"uav{x:.0f}" for name, x in found.items())
            ages += [now - frame.captured] * len(found)
    assert len(ages) == 300 * 5
    assert max(ages) == 0


def test_the_status_names_a_second_publisher_and_whose_clock_has_stepped(source: Callable[..., RosSource]) -> None:
    ros, topic = source(), "/vrpn_mocap/uav1/pose"
    ros.publishers = tuple(End(0, "MP", node, topic, dds_type(POSE), "") for node in ("/driver", "/replay"))
    ros.message(topic, POSE, pose(1 * SECOND), NOW, b"driver")
    ros.message(topic, POSE, pose(9 * SECOND), NOW, b"replay")
    ros.message(topic, POSE, pose(5 * SECOND), NOW + 1, b"driver")
    who = "/vrpn_mocap/uav1/pose (/driver, /replay)"
    counts = {f"poses of a second publisher, {who}": 1, f"steps of the clock of {who}": 1}
    assert dict(ros.state(NOW).counts) == counts
    ros.message(topic, POSE, pose(9 * SECOND, 3.0), NOW + OWNED + 1, b"replay")  # the first has ended
    assert ros.take(NOW)[-1].bodies[0].position[0] == 3.0


def test_while_poses_arrive_nothing_is_wrong_and_poses_without_a_stamp_are_said(
    source: Callable[..., RosSource],
) -> None:
    ros, topic = source(), "/vrpn_mocap/uav1/pose"
    ros.failure, ros.advice = "", "/driver announces it, but publishes nothing"
    ros.message(topic, POSE, pose(0), NOW)
    assert ros.state(NOW).trouble == NO_STAMP.format(topic, UNSET)
    ros.message(topic, POSE, pose(1000), NOW)
    assert ros.state(NOW + SECOND - 1).trouble == ""
    assert ros.state(NOW + SECOND).trouble == ros.advice
    ros.message(topic, POSE, pose(1000), NOW + 9)
    assert ros.state(NOW + SECOND).trouble == NO_STAMP.format(topic, SAME)
