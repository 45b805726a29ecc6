"""A recorder that is restarted in flight: its parts are one trace."""

import json
import os
import signal
import subprocess
import sys
from datetime import timedelta

import pytest
from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from flockwire_core import clock
from flockwire_core.domain.pose import Pose
from flockwire_core.trace_files import next_part, parts
from flockwire_core.wire.codec import encode
from flockwire_recorder.folders import SAME_FLIGHT, same_flight
from flockwire_recorder.recover import recover
from flockwire_recorder.trace import TraceWriter, describe
from mcap.reader import make_reader
from ports import free_ports
from waiting import wait_until

POSE = "geometry_msgs/msg/PoseStamped"
T0 = 1_790_000_000_000_000_000
SWARM = """
name = "parted"
formation = { kind = "circle" }
graph = { edges = [[0, 1]] }
drones = [ { id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.0, 0.0, 0.0] } ]
"""


def write(path, swarm, sequences, closed=True):
    writer = TraceWriter(path, describe(swarm, "", 0, T0))
    for k in sequences:
        payload = encode(Pose(T0 + k, "world", (0.0, 0.0, 1.0)))
        writer.write("/paper/uav1/pose", POSE, b"p" * 16, k, T0 + k, T0 + k, payload)
    writer.close() if closed else writer.flush()


def test_the_next_part_is_the_first_name_that_is_free(tmp_path):
    for name in ("trace.mcap", "trace-2.mcap", "trace-3.mcap"):
        assert next_part(tmp_path).name == name
        (tmp_path / name).touch()
    assert [path.name for path in parts(tmp_path / "trace.mcap")] == ["trace.mcap", "trace-2.mcap", "trace-3.mcap"]
    assert parts(tmp_path / "trace-2.mcap") == (tmp_path / "trace-2.mcap",)


def test_all_parts_are_read_as_one(tmp_path, swarm_of):
    write(tmp_path / "trace.mcap", swarm_of(), range(100), closed=False)
    write(tmp_path / "trace-2.mcap", swarm_of(), range(110, 200))
    trace = read_trace(tmp_path / "trace.mcap")
    assert (trace.recorded, trace.lost, trace.closed) == (190, 10, False)
    assert len(trace.of("pose", 1)) == 190
    assert trace.end - trace.begin == 199


def test_a_part_that_was_cut_off_at_its_beginning_changes_nothing(tmp_path, swarm_of):
    write(tmp_path / "trace.mcap", swarm_of(), range(5))
    (tmp_path / "trace-2.mcap").write_bytes((tmp_path / "trace.mcap").read_bytes()[:40])
    write(tmp_path / "trace-3.mcap", swarm_of(), range(5, 9))
    assert read_trace(tmp_path / "trace.mcap").recorded == 9


def test_a_part_of_another_swarm_is_refused(tmp_path, swarm_of):
    write(tmp_path / "trace.mcap", swarm_of(), range(5))
    write(tmp_path / "trace-2.mcap", swarm_of(obstacle=False), range(5))
    with pytest.raises(ValueError, match=r"trace-2\.mcap: is from another swarm"):
        read_trace(tmp_path / "trace.mcap")


def test_all_parts_are_recovered_into_one(tmp_path, swarm_of):
    write(tmp_path / "trace.mcap", swarm_of(), range(100), closed=False)
    write(tmp_path / "trace-2.mcap", swarm_of(), range(110, 200))
    whole = tmp_path / "whole" / "trace.mcap"
    whole.parent.mkdir()
    assert recover(tmp_path / "trace.mcap", whole) == 190
    before, trace = read_trace(tmp_path / "trace.mcap"), read_trace(whole)
    assert (before.lost_bytes, before.closed) == (0, False)
    assert (trace.recorded, trace.lost, trace.closed) == (190, 10, True)
    with whole.open("rb") as stream:
        assert [one.name for one in make_reader(stream).iter_metadata()] == ["flockwire", "publisher"]


def test_a_recorder_restarted_continues_with_its_own_flight_alone(tmp_path, swarm_of):
    now = clock.utc()
    assert not same_flight(tmp_path, swarm_of(), now)
    write(tmp_path / "trace.mcap", swarm_of(), range(5))
    assert same_flight(tmp_path, swarm_of(), now)
    assert not same_flight(tmp_path, swarm_of(obstacle=False), now)
    assert not same_flight(tmp_path, swarm_of(), now + timedelta(seconds=SAME_FLIGHT + 60))
    (tmp_path / "trace.mcap").write_bytes(b"another program's")
    assert not same_flight(tmp_path, swarm_of(), now)


def await_recording(path):
    wait_until(lambda: path.exists() and path.stat().st_size > 15_000, 30.0)


@pytest.mark.integration
@pytest.mark.long
def test_a_recorder_killed_and_restarted_continues_in_its_folder(tmp_path):
    swarm, out = tmp_path / "swarm.toml", tmp_path / "out"
    swarm.write_text(f'{SWARM}network = {{ security = "none", base_port = {free_ports()} }}\n')
    lifeline, _held = os.pipe()
    child = {"env": {**os.environ, "FLOCKWIRE_LIFELINE": str(lifeline)}, "pass_fds": (lifeline,)}

    def start(kind, *options, **how):
        command = [sys.executable, "-m", "flockwire_operator", kind, str(swarm), *options]
        return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **how)

    airframes = start("kinematics", **child)
    try:
        for name, last in (("trace.mcap", signal.SIGKILL), ("trace-2.mcap", signal.SIGTERM)):
            recorder = start("recorder", "--out", str(out), **child)
            await_recording(out / name)
            recorder.send_signal(last)
            _, log = recorder.communicate(timeout=10)
        assert recorder.returncode == 0, log
        by_hand = start("recorder", "--out", str(out))
        await_recording(out / "trace-3.mcap")
        by_hand.terminate()
        by_hand.communicate(timeout=10)
    finally:
        airframes.terminate()
        airframes.communicate(timeout=10)
    assert by_hand.returncode == 0
    assert len(parts(out / "trace.mcap")) == 3
    trace = read_trace(out / "trace.mcap")
    logged = trace.of("truth", 1).logged
    assert len(logged) > 100
    recording = next(check for check in summarise(trace).checks if check.name == "recording")
    assert recording.value > 0.2  # s: the recorder's start takes longer than any pause of its messages
    assert recording.ok == (recording.value <= recording.limit)
    json.dumps(recording.as_json())


def test_a_process_that_restarted_while_nothing_was_recorded_is_another_publisher_of_the_whole(tmp_path, swarm_of):
    for name, publisher, sequences in (("trace", b"a", range(300, 310)), ("trace-2", b"b", range(10))):
        writer = TraceWriter(tmp_path / f"{name}.mcap", describe(swarm_of(), "", 0, T0))
        for k in sequences:
            payload = encode(Pose(T0 + k, "world", (0.0, 0.0, 1.0)))
            writer.write("/paper/uav1/pose", POSE, publisher * 16, k, T0 + k, T0 + k, payload)
        writer.close()
    assert recover(tmp_path / "trace.mcap", tmp_path / "whole.mcap") == 20
    for path in ("trace.mcap", "whole.mcap"):
        trace = read_trace(tmp_path / path)
        assert (trace.lost_bytes, trace.closed) == (0, True)
        assert (trace.recorded, trace.lost) == (20, 0)
