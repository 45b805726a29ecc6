import asyncio
import os

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.ros.messages import NAMED_POSES, POSE, POSES, TRANSFORMS, NamedPose, pose_array, transforms
from flockwire_core.swarm.reading import NO_FILE
from flockwire_core.wire.cdr import Writer
from flockwire_core.wire.codec import encode
from flockwire_lab.flight import TraceFile
from flockwire_lab.world import World
from flockwire_mocap.core import make_core
from flockwire_mocap.process import feed
from flockwire_mocap.replay import read_poses
from mcap.writer import Writer as Recorder

NOW = 1_790_000_000 * SECOND
LEVEL = (0.0, 0.0, 0.0, 1.0)
MS = SECOND // 1000


@pytest.mark.parametrize("pace", [1.0, 4.0])
def test_poses_come_again_at_their_pace_with_stamps_of_now(start, pace):
    core = make_core(start(source="replay", replay={"trace": "x", "pace": pace}))
    core.source.load([NamedPose(10 * MS * k, f"uav{i}", (0.01 * k, i, 1.0), LEVEL) for k in range(40) for i in (1, 2)])
    seen = []
    for k in range(10):
        now = NOW + 10 * MS * k
        for key, pose in core.step(now):
            if key.kind == "pose" and key.owner == "uav1":
                seen.append((pose.stamp - NOW, round(100 * pose.position[0])))
    assert seen == [(round(10 * MS * k), round(pace * k)) for k in range(10)]


def test_its_end_is_reported(start):
    core = make_core(start(source="replay", replay={"trace": "a.mcap"}))
    core.source.load([NamedPose(0, "uav1", (0.0, 0.0, 1.0), LEVEL)])
    core.step(NOW)
    assert core.report(NOW + 2 * SECOND).detail == "a.mcap has ended"


def test_the_poses_of_a_trace_are_read_also_where_it_is_cut_off(make_swarm, tmp_path):
    path, swarm = tmp_path / "trace.mcap", make_swarm()
    trace = TraceFile(path, swarm, "", 0)
    World(swarm, 0, 1.0, (), trace.take).run()
    trace.close()
    whole = read_poses(path, swarm)
    assert {pose.name for pose in whole} == {f"uav{i}" for i in range(5)}
    assert whole == sorted(whole, key=lambda pose: pose.stamp)
    written = path.read_bytes()
    path.write_bytes(written[: len(written) // 2])
    cut = read_poses(path, swarm)
    assert cut == whole[: len(cut)]
    assert len(cut) > 100
    path.with_stem("trace-2").write_bytes(written)  # the recorder was started again
    assert set(read_poses(path, swarm)) == set(whole)


@pytest.mark.parametrize("content", [b"", b"nothing of the kind", None])
def test_a_file_that_is_not_a_trace_is_refused_in_a_line(make_swarm, tmp_path, content):
    path, swarm = tmp_path / "a.mcap", make_swarm()
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(OSError, match=r"a\.mcap"):
        read_poses(path, swarm)


def test_a_pipe_is_refused_and_not_waited_for(make_swarm, tmp_path):
    os.mkfifo(tmp_path / "pipe.mcap")
    with pytest.raises(OSError, match=NO_FILE):
        read_poses(tmp_path / "pipe.mcap", make_swarm())


@pytest.fixture
def bag(tmp_path):
    """Write a bag of messages: recorded (ns), topic, type, payload; returns its path."""

    def write(*messages):
        path = tmp_path / "bag.mcap"
        with path.open("wb") as file:
            recorder = Recorder(file)
            recorder.start("ros2", "libmcap")
            channels = {}
            for recorded, topic, kind, payload in messages:
                if topic not in channels:
                    schema = recorder.register_schema(kind, "ros2msg", b"")
                    channels[topic] = recorder.register_channel(topic, "cdr", schema)
                recorder.add_message(channels[topic], recorded, payload, recorded)
            recorder.finish()
        return path

    return write


def pose(stamp, x):
    return encode(Pose(stamp, "world", (x, 0.0, 1.0), LEVEL))


@pytest.mark.parametrize("back", [3 * SECOND, 100_000_000 * SECOND])
def test_a_clock_that_was_set_back_changes_no_order(bag, make_swarm, back):
    stamps = [NOW + 10 * MS * k - (back if k >= 50 else 0) for k in range(100)]
    path = bag(
        *[(NOW + 10 * MS * k, f"/m/uav{i}/pose", POSE, pose(at, k)) for k, at in enumerate(stamps) for i in (0, 1)]
    )
    found = [(one.stamp // MS, one.position[0]) for one in read_poses(path, make_swarm()) if one.name == "uav1"]
    assert found == [(10 * k, k) for k in range(100)]


def test_publishers_with_other_clocks_and_poses_without_a_stamp_are_in_the_order_of_the_recording(bag, make_swarm):
    clocks = {"uav0": 0, "uav1": -50 * SECOND, "uav2": 7000 * SECOND, "uav3": -NOW}
    path = bag(
        *[
            (NOW + 10 * MS * k, f"/m/{name}/pose", POSE, pose(max(0, NOW + 10 * MS * k + offset), k))
            for k in range(50)
            for name, offset in clocks.items()
        ]
    )
    for one in read_poses(path, make_swarm()):
        assert one.stamp // MS in (10 * one.position[0], 10 * one.position[0] + 10)


def named(stamp, places):
    writer = Writer()
    writer.time(stamp)
    writer.text("world")
    writer.unsigned(len(places))
    for name, x in places.items():
        writer.text(name)
        writer.put_all("d", x, 0.0, 1.0, *LEVEL)
    return writer.finish()


PLACES = {"cf0": 0.0, "cf1": 1000.0, "cf2": 2000.0, "cf3": 3000.0, "cf4": 4000.0, "person": 5000.0}
FOREIGN = {
    "topic": ({"topic": "/{body}/pose"}, [(f"/{name}/pose", POSE, pose(NOW, x)) for name, x in PLACES.items()]),
    "named": ({"array": "/poses"}, [("/poses", NAMED_POSES, named(NOW, PLACES))]),
    "ordered": (
        {"array": "/poses", "bodies": list(PLACES)},
        [("/poses", POSES, pose_array(NOW, "w", [((x, 0.0, 1.0), LEVEL) for x in PLACES.values()]))],
    ),
    "tf": (
        {"array": "/tf"},
        [("/tf", TRANSFORMS, transforms("w", [NamedPose(NOW, n, (x, 0.0, 1.0), LEVEL) for n, x in PLACES.items()]))],
    ),
}


@pytest.mark.parametrize("kind", FOREIGN)
def test_a_bag_of_another_lab_is_played_on_the_field(bag, start, kind):
    keys, messages = FOREIGN[kind]
    path = bag(*[(NOW, *message) for message in messages])
    bodies = {f"drones.{i}.body": f"cf{i}" for i in range(5)}
    replay = {"trace": str(path), "unit": "mm", **keys}
    core = make_core(start(changes=bodies, source="replay", offset=[0.0, 7.0, 0.0], replay=replay))

    async def play():
        async with feed(core, lambda: None):
            return core.step(NOW)

    published = dict(asyncio.run(play()))
    places = {key.owner: message.position[:2] for key, message in published.items() if key.kind == "pose"}
    assert places == {f"uav{i}": (float(i), 7.0) for i in range(5)}
    assert core.source.take(NOW + SECOND) == []


def test_a_bag_without_the_swarms_bodies_names_those_that_it_has(bag, make_swarm, start):
    path = bag((NOW, "/cf1/pose", POSE, pose(NOW, 1.0)), (NOW, "/rosout", "rcl_interfaces/msg/Log", b""))
    with pytest.raises(OSError, match=r"on /SWARM/uavN/pose; poses are on /cf1/pose: set gateway.replay.topic"):
        read_poses(path, make_swarm())
    core = make_core(start(source="replay", replay={"trace": str(path), "topic": "/{body}/pose"}))

    async def play():
        async with feed(core, lambda: None):
            pass

    with pytest.raises(OSError, match="has no poses of uav0, uav1, uav2, uav3, uav4, but of cf1: set `body`"):
        asyncio.run(play())
