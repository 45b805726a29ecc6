import pytest
from flockwire_mocap.replay.reading import read_poses
from flockwire_sim.recording import TraceFile
from flockwire_sim.world import World


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
