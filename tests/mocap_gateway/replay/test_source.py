import pytest
from flockwire.domain.time import SECOND
from flockwire_mocap.core import make_core
from flockwire_mocap.replay.source import RecordedPose, read_poses
from flockwire_sim.flight import TraceFile
from flockwire_sim.world import World

NOW = 1_790_000_000 * SECOND
LEVEL = (0.0, 0.0, 0.0, 1.0)
MS = SECOND // 1000


@pytest.mark.parametrize("pace", [1.0, 4.0])
def test_poses_come_again_at_their_pace_with_stamps_of_now(start, pace):
    core = make_core(start(source="replay", replay={"trace": "x", "pace": pace}))
    core.source.load([RecordedPose(10 * MS * k, i, (0.01 * k, i, 1.0), LEVEL) for k in range(40) for i in (1, 2, 9)])
    seen = []
    for k in range(10):
        now = NOW + 10 * MS * k
        for key, pose in core.step(now):
            if key.kind == "pose" and key.owner == "uav1":
                seen.append((pose.stamp - NOW, round(100 * pose.position[0])))
    assert seen == [(round(10 * MS * k), round(pace * k)) for k in range(10)]


def test_its_end_is_reported(start):
    core = make_core(start(source="replay", replay={"trace": "a.mcap"}))
    core.source.load([RecordedPose(0, 1, (0.0, 0.0, 1.0), LEVEL)])
    core.step(NOW)
    assert core.report(NOW + 2 * SECOND).detail == "a.mcap has ended"


def test_the_poses_of_a_trace_are_read_also_where_it_is_cut_off(make_swarm, tmp_path):
    path, swarm = tmp_path / "trace.mcap", make_swarm()
    trace = TraceFile(path, swarm, "", 0)
    World(swarm, 0, 1.0, (), trace.take).run()
    trace.close()
    whole = read_poses(path)
    assert {pose.drone for pose in whole} == set(range(5))
    assert whole == sorted(whole, key=lambda pose: pose.elapsed)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    cut = read_poses(path)
    assert cut == whole[: len(cut)]
    assert len(cut) > 100


@pytest.mark.parametrize("content", [b"", b"nothing of the kind", None])
def test_a_file_that_is_not_a_trace_is_refused_in_a_line(tmp_path, content):
    path = tmp_path / "a.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(OSError, match=r"a\.mcap"):
        read_poses(path)
