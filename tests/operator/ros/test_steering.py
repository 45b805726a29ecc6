"""The leader that follows a ROS topic: by velocities or by places, bounded, and still when they stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.codec import encode
from flockwire_core.wire.keys import STEERING, Key
from flockwire_operator.ros.steering import Steering

NOW = 1_790_000_000 * SECOND
KEY = Key(STEERING, "uav0")


@pytest.fixture
def steering(ros_plan: Callable[..., Any]) -> Callable[..., Steering]:
    """Return the builder of the steering by messages of a type."""

    def make(message: str = "TwistStamped") -> Steering:
        leader = {"kind": "ros", "speed": 0.5, "ros": {"topic": "/joy/cmd_vel", "message": message}}
        return Steering(ros_plan({"leader": leader, "control.law": "extended"}).swarm, 0)

    return make


def test_a_velocity_becomes_one_command_within_the_leaders_speed(steering: Callable[..., Steering]) -> None:
    leader = steering()
    assert leader.topic[:2] == ("/joy/cmd_vel", "geometry_msgs/msg/TwistStamped")
    assert leader.command(NOW) == []
    leader.take(encode(Steer(5, "world", (0.1, 0.0, 0.0))), NOW)
    leader.take(encode(Steer(6, "", (0.3, 0.0, 0.4))), NOW)
    assert leader.command(NOW) == [(KEY, Steer(NOW, "world", (0.3, 0.0, 0.4)))]
    assert leader.command(NOW + 1) == []  # silence is passed on as silence
    leader.take(encode(Steer(7, "world", (3.0, 0.0, 4.0))), NOW)
    ((_, command),) = leader.command(NOW)
    assert command.velocity == pytest.approx((0.3, 0.0, 0.4))


def test_a_place_is_followed_with_its_velocity(steering: Callable[..., Steering]) -> None:
    leader = steering("PoseStamped")
    leader.take(encode(Pose(5, "world", (1.0, 0.0, 1.0))), NOW)
    assert leader.command(NOW) == []  # its own position is not known yet
    leader.position((0.9, 0.0, 1.0))
    leader.take(encode(Pose(5, "world", (1.0, 0.0, 1.0))), NOW + SECOND // 100)
    ((_, command),) = leader.command(NOW)
    assert command.velocity == pytest.approx((0.2, 0.0, 0.0))  # tracking_gain is 2/s
    for k in range(200):  # a place that moves at 0.3 m/s along y; the leader is at it
        leader.position((1.0, 0.003 * k, 1.0))
        leader.take(encode(Pose(5, "world", (1.0, 0.003 * k, 1.0))), NOW + (k + 2) * SECOND // 100)
    ((_, command),) = leader.command(NOW)
    assert command.velocity == pytest.approx((0.0, 0.3, 0.0), abs=1e-3)


def test_what_is_no_such_message_is_dropped_and_counted(steering: Callable[..., Steering]) -> None:
    leader = steering()
    good = encode(Steer(5, "world", (0.1, 0.0, 0.0)))
    wrong = [
        good[:-1],
        b"",
        b"\0" * 84,
        good.replace(b"world", b"wor\xffd"),
        encode(Pose(5, "world", (0.0,) * 3))[:-40],
    ]
    wrong.append(encode(Steer(5, "world", (float("nan"), 0.0, 0.0))))
    for payload in wrong:
        leader.take(payload, NOW)
    leader.take(encode(Steer(5, "base_link", (0.1, 0.0, 0.0))), NOW)
    assert leader.command(NOW) == []
    assert leader.counts == {"ROS steering malformed": len(wrong), "ROS steering of another frame": 1}


def test_numbers_too_large_to_compute_with_do_not_spoil_what_follows(steering: Callable[..., Steering]) -> None:
    for kind, spoilt in (
        ("PoseStamped", Pose(5, "world", (1e308, 0.0, 0.0))),
        ("TwistStamped", Steer(5, "", (0.0, -1e307, 0.0))),
    ):
        leader = steering(kind)
        leader.position((0.0, 0.0, 1.0))
        for k in range(3):
            leader.take(encode(spoilt), NOW + k * SECOND // 100)
        assert leader.command(NOW) == []
        assert leader.counts == {"ROS steering out of range": 3}
        good = Pose(6, "world", (0.1, 0.0, 1.0)) if kind == "PoseStamped" else Steer(6, "", (0.2, 0.0, 0.0))
        leader.take(encode(good), NOW + SECOND // 10)
        ((_, command),) = leader.command(NOW + SECOND // 10)
        assert command.velocity == pytest.approx((0.2, 0.0, 0.0))


def test_only_the_ros_process_steers_such_a_leader(ros_plan: Callable[..., Any]) -> None:
    plan = ros_plan({"leader": {"kind": "ros"}, "control.law": "extended"})
    assert KEY in plan.publishes["ros"]
    assert KEY in plan.subscribes["leader"]
    assert "teleop" not in plan.identities
    assert "steering" not in {key.kind for key in ros_plan().keys}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"leader": {"kind": "ros"}}, "leader.kind = 'ros': needs a table [ros]"),
        ({"ros.router": "127.0.0.1"}, "ros.router = '127.0.0.1': must be ADDRESS:PORT, as 127.0.0.1:7447 (IPv6"),
        ({"ros.domain": 233}, "ros.domain = 233"),
        ({"ros.namespace": "paper"}, "ros.namespace = 'paper': must be an absolute ROS name"),
        ({"ros.orders": ["fly"]}, "ros.orders.0 = 'fly': must be"),
        ({"ros": {}, "leader": {"kind": "ros", "ros": {"topic": "/flock/uav0/cmd_vel"}}}, "leader.ros.topic = "),
        (
            {"gateway": {"source": "ros", "ros": {"topic": "/a/pose"}}},
            "gateway.ros.topic = '/a/pose': must be an absolute ROS name with {body}",
        ),
        (
            {"ros": {}, "gateway": {"source": "ros", "ros": {"topic": "/flock/{body}/pose"}}},
            "gateway.ros.topic = '/flock/{body}/pose': must not be a topic that this swarm publishes, /flock/uav0/pose",
        ),
        (
            {"gateway": {"source": "ros", "ros": {"array": "/poses", "bodies": ["uav0"]}}},
            "gateway.ros.bodies = ['uav0']: must have body 'uav1' of uav1",
        ),
        (
            {"ros.orders": ["formation"], "formations": {"a b": {"kind": "circle", "radius": 3.0, "rate": 0.5}}},
            "formations.a b: must be letters, digits and _",
        ),
    ],
)
def test_a_wrong_file_says_key_value_and_rule(
    make_swarm: Callable[..., Any], changes: dict[str, Any], says: str
) -> None:
    from flockwire_core.loading import SwarmFileError

    with pytest.raises(SwarmFileError) as refused:
        make_swarm({"control.law": "extended", **changes})
    assert f"test.toml: {says}" in str(refused.value)


def test_such_a_leader_flies_by_commands_as_a_teleoperated_one_does(ros_plan: Callable[..., Any]) -> None:
    for kind in ("ros", "teleoperated"):
        assert ros_plan({"leader": {"kind": kind}, "control.law": "extended"}).swarm.leader.steered


def test_a_point_that_flies_these_commands_reaches_a_moving_place(steering: Callable[..., Steering]) -> None:
    leader, position = steering("PoseStamped"), (0.0, 0.0, 1.0)
    for k in range(800):
        place = (1.0 + 0.003 * k, -0.5, 1.2)  # 0.3 m/s, within the leader's 0.5 m/s
        leader.position(position)
        leader.take(encode(Pose(5, "world", place)), NOW + k * SECOND // 100)
        ((_, command),) = leader.command(NOW + k * SECOND // 100) or [(KEY, Steer(0, "world", (0.0, 0.0, 0.0)))]
        assert sum(v * v for v in command.velocity) <= 0.25 + 1e-9
        position = tuple(x + 0.01 * v for x, v in zip(position, command.velocity, strict=True))
    assert position == pytest.approx(place, abs=0.01)
