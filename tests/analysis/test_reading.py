"""What is read from a trace."""

import json
import re
import sys

import numpy as np
import pytest
from flockwire_analysis.gaps import beside, longest_gap
from flockwire_analysis.reading import read_trace
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.codec import encode
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status
from flockwire_recorder.trace import TraceWriter, describe

T0 = 1_790_000_000_000_000_000


@pytest.fixture
def writer(tmp_path, swarm_of):
    return TraceWriter(tmp_path / "a.mcap", describe(swarm_of(), "text", 3, T0))


def pose(stamp, x):
    from flockwire_core.domain.pose import Pose

    return encode(Pose(stamp, "world", (x, 0.0, 1.0)))


def say(writer, publisher, sequence, payload, topic="/paper/uav1/pose"):
    writer.write(topic, "geometry_msgs/msg/PoseStamped", publisher, sequence, T0 + sequence, T0, payload)


def test_series_stand_in_the_order_of_stamps(writer, tmp_path):
    for sequence, stamp in enumerate((5, 3, 4)):
        say(writer, b"a", sequence, pose(T0 + stamp, float(stamp)))
    writer.close()
    trace = read_trace(tmp_path / "a.mcap")
    series = trace.of("pose", 1)
    assert (series.stamps - T0).tolist() == [3, 4, 5]
    assert series.values[:, 0].tolist() == [3.0, 4.0, 5.0]
    assert series.sequences.tolist() == [1, 2, 0]
    assert (series.logged - T0).tolist() == [1, 2, 0]
    assert series.published.dtype == np.int64
    assert trace.of("truth", 1).values.shape == (0, 3)
    assert (trace.begin - T0, trace.end - T0) == (0, 2)
    assert trace.metadata["toml"] == "text"


@pytest.mark.parametrize("wrong", [1, T0 + 400 * 86_400 * SECOND, 2**63 - 1])
def test_a_wrong_log_time_is_a_malformed_message_and_not_another_year(writer, tmp_path, wrong):
    for k in range(200):
        at = wrong if k in (0, 100, 198) else T0 + k
        writer.write("/paper/uav1/pose", "geometry_msgs/msg/PoseStamped", b"a", k, at, T0 + k, pose(T0 + k, 0.0))
    writer.close()
    trace = read_trace(tmp_path / "a.mcap")
    assert T0 <= trace.begin <= trace.end == T0 + 199
    assert trace.recorded == 200
    assert 3 <= trace.malformed < 30
    assert (len(trace.of("pose", 1)), trace.lost) == (200, 0)


def test_gaps_are_counted_for_each_publisher(writer, tmp_path):
    for publisher, sequences in ((b"a", (7, 8, 11, 11)), (b"b", (0, 2))):
        for sequence in sequences:
            say(writer, publisher, sequence, pose(T0, 0.0))
    writer.close()
    trace = read_trace(tmp_path / "a.mcap")
    assert (trace.lost, trace.recorded) == (3, 6)


def test_what_a_dispensable_process_lost_is_said_and_not_judged(tmp_path, swarm_of):
    swarm = swarm_of(ros={})
    plan, said = Plan(swarm), {}
    for identity in ("ros", "uav1"):
        writer = TraceWriter(tmp_path / f"{identity}.mcap", describe(swarm, "text", 1, T0))
        for sequence in (0, 1, 12, 13):
            at = T0 + sequence * SECOND // 10
            status = encode(Status(at, "world", identity, Report(Phase.SERVING), 1, 0, 0, 0, 0, 0.1, 1, (), ()))
            topic = f"/{plan.text(Key('status', identity))}"
            writer.write(topic, "flockwire_msgs/msg/Status", b"a", sequence, at, at, status)
        writer.close()
        trace = read_trace(tmp_path / f"{identity}.mcap")
        said[identity] = (trace.lost, trace.lost_beside, longest_gap(trace).length, beside(trace))
    assert said == {
        "ros": (
            0, 10, 0.0, "messages that a flight can do without were not recorded: 10, "
            "up to 1.1 s in /paper/ros/status, from t = 0.1 s on; no check counts them",
        ),
        "uav1": (10, 0, 1.1, ""),
    }  # fmt: skip


def test_what_cannot_be_decoded_is_counted(writer, tmp_path):
    say(writer, b"a", 0, pose(T0, 0.0))
    say(writer, b"a", 1, b"nonsense")
    say(writer, b"a", 2, pose(T0, float("nan")))
    say(writer, b"a", 3, pose(T0, 0.0), "/paper/uav9/pose")
    writer.close()
    trace = read_trace(tmp_path / "a.mcap")
    assert (trace.recorded, trace.malformed, trace.lost) == (4, 3, 0)
    assert list(trace.series) == [Key("pose", "uav1")]


def test_a_repeated_mission_is_one(fly):
    trace = read_trace(fly(begin=-2.0, end=0.1, lands=False))
    assert [mission.verb for mission in trace.missions] == ["takeoff", "start"]
    assert len(trace.vitals) == 5
    assert trace.vitals[0].cpu == pytest.approx(0.07)
    assert trace.of("telemetry", 1).values.shape[1] == 4


def test_a_missing_law_is_harmless(tmp_path, swarm_of):
    table = swarm_of().model_dump(mode="json")
    table["control"]["law"] = "long.gone:Law"
    TraceWriter(tmp_path / "a.mcap", {"swarm": json.dumps(table)}).close()
    assert read_trace(tmp_path / "a.mcap").swarm.control.law == "long.gone:Law"


def test_reading_a_trace_imports_no_law(tmp_path, swarm_of, monkeypatch):
    (tmp_path / "a_law_that_raises.py").write_text("raise AssertionError('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    table = swarm_of().model_dump(mode="json")
    table["control"]["law"] = "a_law_that_raises:Law"
    TraceWriter(tmp_path / "a.mcap", {"swarm": json.dumps(table)}).close()
    assert read_trace(tmp_path / "a.mcap").swarm.control.law == "a_law_that_raises:Law"
    assert "a_law_that_raises" not in sys.modules


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"hosts": {}}, "hosts: at least one host is needed"),
        ({"graph": {"edges": [[0, 1], [1, 9]]}}, "graph.edges.1 = [1, 9]: there is no drone 9"),
        ({"formation": {"kind": "line", "spacing": 0.01}}, "formation: its drones come within 0.01 m"),
    ],
)
def test_a_trace_whose_swarm_breaks_a_rule_is_refused_by_that_rule(tmp_path, swarm_of, changes, line):
    table = swarm_of().model_dump(mode="json") | changes
    TraceWriter(tmp_path / "a.mcap", {"swarm": json.dumps(table)}).close()
    with pytest.raises(ValueError, match=re.escape(f"its swarm is from another version of flockwire: {line}")):
        read_trace(tmp_path / "a.mcap")


def test_another_programs_file_is_refused(tmp_path):
    path = tmp_path / "a.mcap"
    TraceWriter(path, {"swarm": "{}"}).close()
    with pytest.raises(ValueError, match="another version"):
        read_trace(path)
