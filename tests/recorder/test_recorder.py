"""The recorder on samples by hand: what it drops, and what it reports once its disk is full."""

import asyncio
import threading
from contextlib import nullcontext
from errno import ENOSPC
from itertools import pairwise

import pytest
from buffered_session import T0, BufferedSession
from flockwire_analysis import report
from flockwire_analysis.reading import read_trace
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import unrecorded
from flockwire_core.runtime import job as jobs
from flockwire_core.runtime import topics
from flockwire_core.runtime.job import Job, serve
from flockwire_core.runtime.samples import Publishing
from flockwire_core.wire.batch import MOST, Batch, Entry
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.inbox import ATTACHMENT, BURST
from flockwire_core.wire.keys import BATCH, ROWS, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status
from flockwire_operator.cli.verdict import conclude
from flockwire_recorder import process
from flockwire_recorder.full import TraceFullError
from flockwire_recorder.process import Recorder
from flockwire_recorder.trace import TraceWriter, describe
from mcap.reader import make_reader


class Refusals:
    """No connection was refused."""

    count = 0

    def watch(self):
        """Leave the standard output alone."""


@pytest.fixture
def recording(tmp_path, swarm_of):
    """Return a recorder, its session and its trace."""
    plan, session = Plan(swarm_of()), BufferedSession()
    trace = TraceWriter(tmp_path / "trace.mcap", describe(plan.swarm, "", 0, T0))
    session.plan, session.identity = plan, "recorder"
    return Recorder(session, trace, Refusals()), session, trace


POSE, STATUS = Key("pose", "uav1"), Key("status", "uav1")
A = (0.0, 0.0, 1.0)


def pose(stamp, x=0.0, y=0.0):
    """Return the bytes of a pose."""
    return encode(Pose(stamp, "world", (x, y, 1.0)))


def test_an_insiders_large_statuses_are_dropped_and_counted(recording, tmp_path):
    recorder, session, trace = recording
    session.put_batched("gateway", (POSE, pose(T0), 0, T0))
    for tick in range(100):
        for k in range(1000):
            session.put(STATUS, b"x" * 60_000, 1000 * tick + k)
        recorder.tick(0, 0)
    assert len(session.rings[STATUS]) == 0
    assert session.rings[STATUS].maxlen <= 200
    recorder.close()
    assert trace.written == 1
    assert (tmp_path / "trace.mcap").stat().st_size < 50_000
    rejected = {key: count for status in session.statuses[-1:] for key, count in status.rejected}
    assert rejected.keys() == {"paper/uav1/status over quota", "paper/uav1/status overflow"}
    assert rejected["paper/uav1/status over quota"] > 10_000
    assert recorder._rejected["paper/uav1/status overflow"] == 100


@pytest.mark.parametrize("forged", [0, 2**62, -(2**62)])
def test_a_forged_time_is_not_written_as_the_time_of_publication(recording, tmp_path, monkeypatch, forged):
    recorder, session, _ = recording
    monkeypatch.setattr(process.clock, "now", lambda: T0 + 5)
    for sequence, sent in enumerate((T0, forged)):
        session.put_batched("gateway", (POSE, pose(T0 + sequence), sequence, sent))
    recorder.drain(T0 + 5)
    recorder.close()
    assert (read_trace(tmp_path / "trace.mcap").of("pose", 1).published - T0).tolist() == [0, 5]


def test_a_full_disk_shows_in_the_status_and_ends_with_a_sentence(recording, small_disk, tmp_path):
    recorder, session, trace = recording
    for k in range(0, 4000, 20):
        session.put_batched("gateway", *((POSE, pose(T0 + n, n * 0.1, n**0.5), n, T0) for n in range(k, k + 20)))
        recorder.tick(0, 0)
    session.statuses.clear()
    asyncio.run(asyncio.sleep(0.15))
    recorder.tick(0, 0)
    status = session.statuses[-1]
    assert (status.report.phase, status.report.detail) == ("full", "the trace takes no more: File too large")
    assert dict(status.rejected) == {"not recorded": trace.dropped}
    assert decode(Status, encode(status)) == status
    said = unrecorded(Plan(read_trace(tmp_path / "trace.mcap").swarm).recorders, {"recorder": status})
    assert said == "recorder: the trace takes no more: File too large"
    with pytest.raises(TraceFullError, match=r"^\S+trace\.mcap: the trace takes no more: File too large$"):
        recorder.close()
    assert read_trace(tmp_path / "trace.mcap").recorded > 100


@pytest.mark.parametrize("full", [False, True])
def test_the_trace_is_complete_before_the_process_is_ended_in_any_case(monkeypatch, swarm_of, tmp_path, full):
    done, close = [], TraceWriter.close

    class LinkedSession(BufferedSession):
        def __enter__(self):
            return self

        def __exit__(self, *_):
            done.append("session")

    def close_trace(trace):
        close(trace)
        done.append("trace")
        if full:
            raise TraceFullError(ENOSPC, "the trace takes no more: No space left on device", "trace.mcap")

    async def at_once(*_):
        session = LinkedSession()
        session.plan, session.identity = job.plan, job.identity
        return session

    class LastTimer:
        def __init__(self, _, __, arguments):
            done.append(arguments)

        def start(self):
            pass

    monkeypatch.setattr(process, "Refusals", lambda _: Refusals())
    monkeypatch.setattr(process, "connect_job", at_once)
    monkeypatch.setattr(process, "wait_for_end", at_once)
    monkeypatch.setattr(threading, "Timer", LastTimer)
    monkeypatch.setattr(TraceWriter, "close", close_trace)
    job = Job(Plan(swarm_of()), "recorder", None, "", tmp_path)
    with pytest.raises(TraceFullError) if full else nullcontext():
        asyncio.run(process.run(job))
    assert done == ["trace", ("recorder", not full), "session"]


def test_a_process_whose_disk_is_full_ends_with_exit_status_1(monkeypatch, swarm_of, tmp_path, caplog):
    async def run(_):
        raise TraceFullError(ENOSPC, "the trace takes no more: No space left on device", "a/trace.mcap")

    monkeypatch.setattr(jobs, "load_object", lambda _: run)
    assert serve(Job(Plan(swarm_of()), "recorder", None, "", tmp_path)) == 1
    assert caplog.messages == ["a/trace.mcap: the trace takes no more: No space left on device"]


def test_a_report_that_cannot_be_written_fails_the_flight_in_a_sentence(good_flight, monkeypatch, capsys):
    def full(*_):
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr(report, "write_files", full)
    path = good_flight
    assert conclude("", path.parent) == 1
    said = capsys.readouterr()
    assert "formation error" in said.out
    assert said.err == (
        f"flockwire: the flight failed: the report cannot be written: {path.parent}: No space left on device\n"
    )


def test_a_trace_that_cannot_be_read_fails_the_flight_in_a_sentence(tmp_path, capsys):
    (tmp_path / "trace.mcap").write_bytes(b"nothing")
    assert conclude("uav1 crashed", tmp_path) == 1
    assert capsys.readouterr().err.startswith("flockwire: the flight failed: uav1 crashed; the trace cannot be read: ")


def test_the_messages_in_a_batch_are_recorded_as_if_each_had_come_alone(recording, tmp_path, monkeypatch):
    recorder, session, _ = recording
    monkeypatch.setattr(process.clock, "now", lambda: T0 + SECOND // 10)
    sent = [T0 + 7 * k for k in range(10)]
    session.put_batched("gateway", *((POSE, pose(at), k, at) for k, at in enumerate(sent)))
    session.put(STATUS, b"", 0, T0 + 30)
    recorder.drain(T0 + SECOND // 10)
    recorder.close()
    with (tmp_path / "trace.mcap").open("rb") as stream:
        read = [(channel, message) for _, channel, message in make_reader(stream).iter_messages()]
    poses = [message for channel, message in read if channel.topic == "/paper/uav1/pose"]
    assert [(m.sequence, m.publish_time, m.log_time, m.data) for m in poses] == [
        (k, at, at, pose(at)) for k, at in enumerate(sent)
    ]
    assert [m.publish_time for _, m in read] == sorted(m.publish_time for _, m in read)


def test_a_recording_has_few_chunks_and_loses_no_more_with_the_process(recording, tmp_path, monkeypatch):
    """Ten seconds at 50 ticks per s; each message of a pose comes at once, each of a command in a batch 0.1 s later."""
    recorder, session, _ = recording
    command = Key("command", "uav1")
    for k in range(500):
        now = T0 + k * SECOND // 50
        monkeypatch.setattr(process.clock, "now", lambda now=now: now)
        session.put_batched("gateway", (POSE, pose(now), k, now))
        if k >= 5:
            session.put_batched("uav1", (command, pose(now), k, now - SECOND // 10))
        recorder.tick(0, 0)
        if k % 100 == 51:  # as after SIGKILL
            assert read_trace(tmp_path / "trace.mcap").of("pose", 1).published[-1] == now
    recorder.close()
    with (tmp_path / "trace.mcap").open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    assert 30 <= len(chunks) <= 60  # not 250
    for one, following in pairwise(chunks):
        assert one.message_end_time - following.message_start_time <= SECOND // 10  # a batch


def test_what_a_process_may_not_publish_is_not_recorded_from_its_batch(recording):
    recorder, session, trace = recording
    estimate, command = Key("estimate", "uav1"), Key("command", "uav1")
    session.put_batched("uav1", (command, pose(T0), 0, T0), (POSE, pose(T0), 0, T0))
    session.put_batched("uav1", (estimate, b"x" * 600, 0, T0), (command, pose(T0), 0, T0))
    session.put(Key("batch", "uav1"), b"\x00\x01\x00\x00junk", 9)
    recorder.tick(0, 0)
    assert trace.written == 1
    assert dict(recorder._rejected) == {
        "paper/uav1/batch of another key": 1,
        "paper/uav1/estimate over quota": 1,
        "paper/uav1/batch malformed": 1,
    }


def test_a_process_that_floods_in_batches_is_held_to_the_quota_of_each_key(recording):
    recorder, session, trace = recording
    command = Key("command", "uav1")
    for k in range(60):
        session.put_batched("uav1", *((command, pose(T0), 200 * k + n, T0) for n in range(200)))
    recorder.drain(T0)
    assert trace.written == pytest.approx(ROWS["command"].rate * BURST, abs=2)


@pytest.mark.sources  # replaces compiled functions
def test_a_drones_batches_bring_no_more_messages_than_a_multiple_of_its_own(recording, monkeypatch):
    recorder, session, trace = recording
    batch, decoded = Key(BATCH, "uav1"), []
    monkeypatch.setattr(topics, "decode", lambda kind, data: decoded.append(decode(kind, data)) or decoded[-1])
    command, unknown = (Entry(f"uav1/{kind}", 0, T0, b"") for kind in ("command", "x"))
    data = encode(Batch(T0, "world", (*[command] * (MOST - 1), unknown)))
    for tick in range(500):  # 10 s
        for k in range(100):
            session.put(batch, data, 100 * tick + k)
        recorder.drain(T0 + tick * SECOND // 50)
    assert trace.written == 0
    assert 0 < sum(len(one.entries) for one in decoded) / (10 + BURST) < 40 * 200  # it is to send 200 a second
    rejected = dict(recorder._rejected)
    assert rejected.pop("paper/uav1/batch of another key") == len(decoded)  # each as a whole
    assert rejected.pop("paper/uav1/batch overflow") == 500
    assert rejected.pop("paper/uav1/batch over quota") == 500 * topics.BATCHES - len(decoded)
    assert not rejected


def test_it_waits_for_each_process_that_no_flight_does_without(recording):
    recorder, session, _ = recording
    unheard = ["gateway", "kinematics"]
    for one in tuple(unheard):
        assert recorder._report() == Report(Phase.WAITING, f"does not hear {', '.join(unheard)}")
        session.put(Key("status", one), b"x", 0)
        recorder.drain(T0)
        unheard.remove(one)
    assert recorder._report() == Report(Phase.RECORDING)


def test_a_batch_of_too_many_messages_is_dropped(recording):
    recorder, session, trace = recording
    command = Key("command", "uav1")
    for count in (MOST, MOST + 1):
        session.put_batched("uav1", *((command, pose(T0), k, T0) for k in range(count)))
    recorder.drain(T0)
    assert trace.written == MOST
    assert recorder._rejected == {"paper/uav1/batch malformed": 1}


def test_what_a_gateway_publishes_of_forty_drones_that_see_each_other_is_all_recorded(tmp_path, swarm_of, monkeypatch):
    drones = [{"id": i, "start": [1.5 * (i % 7), 1.5 * (i // 7), 0.0]} for i in range(41)]
    plan = Plan(
        swarm_of(
            False,
            formation={"kind": "grid", "spacing": 1.0},
            drones=drones,
            graph={"edges": [[0, i] for i in range(1, 41)]},
        )
    )
    session, now, sent = BufferedSession(), T0, 0
    trace = TraceWriter(tmp_path / "trace.mcap", describe(plan.swarm, "", 0, T0))
    session.plan, session.identity = plan, "recorder"
    recorder, batch = Recorder(session, trace, Refusals()), Key(BATCH, "gateway")

    class Publisher:
        def put(self, payload, attachment):
            session.put(batch, payload, ATTACHMENT.unpack(attachment)[0], now)

    monkeypatch.setattr(process.clock, "now", lambda: now)
    publishing = Publishing(plan, "gateway", b"p" * 16, lambda key: (Publisher(),) if key == batch else ())
    seen = tuple(Body(BodyKind.DRONE, (0.1 * k, 0.2, 0.3), 0.0) for k in range(40))
    for step in range(100):
        now = T0 + step * SECOND // 100
        for i in range(41):
            told = (
                (Key("nearby", f"uav{i}"), Nearby(now, "world", seen)),
                (Key("pose", f"uav{i}"), Pose(now, "world", A)),
            )
            publishing.publish(told)
            sent += len(told)
        if step % 2:
            recorder.drain(now)
    publishing.flush()
    recorder.drain(now)
    assert trace.written == sent == 8200
    assert not recorder._rejected
    assert 200 < publishing.outlets[batch].sequence < plan.rate(batch)
