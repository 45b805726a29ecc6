"""The trace on disk: readable by others, there after kill -9, honest about a full disk."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import recorded_flights
from flockwire_analysis.reading import read_trace
from flockwire_core.domain.pose import Pose
from flockwire_core.wire.codec import encode
from flockwire_recorder.full import TraceFullError
from flockwire_recorder.trace import COUNT_BITS, TraceWriter
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

POSE = "geometry_msgs/msg/PoseStamped"
PAYLOAD = encode(Pose(1_790_000_000_000_000_000, "world", (1.0, 2.0, 3.0)))


def fill(writer, count, begin=0):
    for k in range(begin, begin + count):
        writer.write("/paper/uav1/pose", POSE, b"\1" * 16, k, 1000 + k, 900 + k, PAYLOAD)


def test_mcap_reads_back_what_was_written(tmp_path):
    path = tmp_path / "a.mcap"
    writer = TraceWriter(path, {"seed": "7"})
    fill(writer, 3)
    writer.write("/paper/uav1/pose", POSE, b"\2" * 16, 2**32 + 5, 2000, -1, PAYLOAD)
    writer.close()
    writer.close()
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        assert [(record.name, record.metadata) for record in reader.iter_metadata()] == [
            ("flockwire", {"seed": "7"}),
            ("publisher", {"topic": "/paper/uav1/pose", "number": "0", "id": "01" * 16}),
            ("publisher", {"topic": "/paper/uav1/pose", "number": "1", "id": "02" * 16}),
        ]
        rows = list(reader.iter_messages())
    assert [row[2].data for row in rows] == [PAYLOAD] * 4
    assert [(row[2].sequence, row[2].log_time, row[2].publish_time) for row in rows] == [
        (0, 1000, 900), (1, 1001, 901), (2, 1002, 902), (1 << COUNT_BITS | 5, 2000, 0),
    ]  # fmt: skip
    assert len({row[1].id for row in rows}) == 1  # whoever reads a topic reads one channel
    assert {(row[0].name, row[0].encoding, row[1].message_encoding) for row in rows} == {(POSE, "ros2msg", "cdr")}
    assert writer.written == 4


def test_rosbags_understands_every_topic(fly):
    path = fly(begin=-0.5, end=0.5, lands=False)
    with AnyReader([path]) as reader:
        kinds = {connection.topic.rpartition("/")[2] for connection in reader.connections}
        decoded = {c.topic: reader.deserialize(data, c.msgtype) for c, _, data in reader.messages()}
    assert kinds == {"truth", "pose", "nearby", "estimate", "command", "telemetry", "status", "mission"}
    assert decoded["/paper/mission"].verb == "start"
    assert decoded["/paper/uav1/estimate"].velocity.x == pytest.approx(0.1)
    assert decoded["/paper/uav1/status"].rejected_counts.tolist() == [3]


def test_an_unknown_type_is_refused(tmp_path):
    writer = TraceWriter(tmp_path / "a.mcap", {})
    with pytest.raises(KeyError):
        writer.write("/x", "std_msgs/msg/String", b"", 0, 0, 0, b"")


WRITE_FOR_EVER = """
import sys, time
sys.path.insert(0, sys.argv[2])
from pathlib import Path
import recorded_flights
from flockwire_core.domain.pose import Pose
from flockwire_core.wire.codec import encode
from flockwire_recorder.trace import COUNT_BITS, TraceWriter, describe
writer = TraceWriter(Path(sys.argv[1]), describe(recorded_flights.swarm_of(), "", 0, 0))
payload, k = encode(Pose(1, "world", (1.0, 2.0, 3.0))), 0
while True:
    for _ in range(240):
        writer.write("/paper/uav1/pose", "geometry_msgs/msg/PoseStamped", bytes(16), k, k, k, payload)
        k += 1
    writer.flush()
    print(k, flush=True)
    writer.write("/paper/uav1/pose", "geometry_msgs/msg/PoseStamped", bytes(16), k, k, k, payload)
    k += 1
    time.sleep(0.02)
"""


def test_what_was_flushed_outlives_kill_9(tmp_path):
    path = tmp_path / "a.mcap"
    here = str(Path(recorded_flights.__file__).parent)
    command = [sys.executable, "-c", WRITE_FOR_EVER, str(path), here]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        flushed = [int(process.stdout.readline()) for _ in range(20)][-1]
        os.kill(process.pid, signal.SIGKILL)
    trace = read_trace(path)
    assert not trace.closed
    assert trace.recorded >= flushed >= 4800
    assert trace.lost == 0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_disk_that_is_full_from_the_start():
    with pytest.raises(TraceFullError, match=r"^/dev/full: the trace takes no more: No space left on device$"):
        TraceWriter(Path("/dev/full"), {})


def test_a_disk_that_fills_up(tmp_path, small_disk):
    path = tmp_path / "a.mcap"
    writer = TraceWriter(path, {})
    flushed = 0
    with pytest.raises(TraceFullError):
        while True:
            fill(writer, 200, writer.written)
            writer.flush()
            flushed = writer.written
    size = path.stat().st_size
    fill(writer, 10)
    writer.flush()
    writer.close()
    assert writer.dropped == 10
    assert path.stat().st_size == size <= 65536
    assert flushed > 400


def test_a_message_costs_little(tmp_path):
    writer = TraceWriter(tmp_path / "a.mcap", {})
    begin = time.process_time()
    fill(writer, 5000)
    writer.flush()
    assert (time.process_time() - begin) / 5000 < 100e-6
    writer.close()


def test_any_number_of_publishers_may_speak(tmp_path):
    writer = TraceWriter(tmp_path / "a.mcap", {})
    for k in range(66_000):  # MCAP numbers its channels with 16 bits
        writer.write("/paper/uav1/pose", POSE, k.to_bytes(16, "big"), 0, 1000, 900, b"")
    writer.close()
    assert writer.written + writer.dropped == 66_000
