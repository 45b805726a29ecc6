"""A trace in ROS 2: every message in its order, with the flight's clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.codec import encode
from flockwire_core.wire.keys import Key
from flockwire_operator.ros.replay import Replay, read_messages
from flockwire_operator.ros.topics import SIM_CLOCK
from flockwire_recorder.trace import TraceWriter, describe

BEGAN = 1_790_000_000 * SECOND
KEY = Key("pose", "uav1")


def poses(count: int) -> list[tuple[int, Key, Pose]]:
    times = [BEGAN + k * SECOND // 100 for k in range(count)]
    return [(at + 5, KEY, Pose(at, "world", (at % 7 / 7.0, 0.0, 1.0))) for at in times]


def test_the_clock_comes_first_and_messages_come_in_time(
    ros_plan: Callable[..., Any], read: Callable[[bytes, str], Any]
) -> None:
    recorded = poses(50)
    replay = Replay(ros_plan(), recorded)
    assert replay.begin == BEGAN + 5
    found = []
    for now in range(replay.begin, replay.begin + SECOND // 2 + 1, SECOND // 20):
        (topic, first), *rest = replay.until(now)
        stamp = read(first, SIM_CLOCK.ros_type).clock
        assert (topic, stamp.sec * SECOND + stamp.nanosec) == (SIM_CLOCK, now)
        found += [payload for topic, payload in rest if topic.name == "/flock/uav1/pose"]
        assert len(found) == min(50, (now - replay.begin) * 100 // SECOND + 1)
    assert found == [encode(pose) for _, _, pose in recorded]
    assert replay.over


def test_a_trace_is_read_as_it_was_written(ros_plan: Callable[..., Any], tmp_path: Any) -> None:
    plan, path = ros_plan(), tmp_path / "trace.mcap"
    writer = TraceWriter(path, describe(plan.swarm, "", 0, BEGAN, ()))
    for number, (at, _, pose) in enumerate(poses(20)):
        writer.write("/flock/uav1/pose", "geometry_msgs/msg/PoseStamped", bytes(16), number, at, at, encode(pose))
        writer.write("/other/uav1/pose", "geometry_msgs/msg/PoseStamped", bytes(16), number, at, at, encode(pose))
    writer.close()
    assert list(read_messages(plan, path)) == poses(20)
