"""A trace that was cut off anywhere can be read, and made whole."""

import os
import struct
import tracemalloc

import pytest
import zstandard
from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from flockwire_core.swarm.reading import NO_FILE
from flockwire_recorder.records import LARGEST_CHUNK, WholeRecords
from flockwire_recorder.recover import recover
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from rosbags.highlevel import AnyReader


@pytest.fixture(scope="module")
def whole(tmp_path_factory, write_flight):
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    write_flight(path, begin=-0.5, end=1.5)
    return path


@pytest.fixture(scope="module")
def recorded(whole):
    return messages(whole)


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    return tmp_path_factory.mktemp("cut")


def messages(path):
    with path.open("rb") as stream:
        return [
            (channel.topic, m.sequence, m.log_time, m.publish_time, m.data)
            for _, channel, m in make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
        ]


def read(path):
    """Return the records of a part after all are read: the bytes that were lost, and whether it was closed."""
    records = WholeRecords(path)
    for _ in records:
        pass
    return records


def test_a_whole_trace_is_copied_whole(whole, work):
    out = work / "copy.mcap"
    assert recover(whole, out) == len(messages(whole))
    assert (read(whole).lost_bytes, read(whole).closed) == (0, True)
    assert messages(out) == messages(whole)
    with whole.open("rb") as one, out.open("rb") as other:
        assert [m.metadata for m in make_reader(one).iter_metadata()] == [
            m.metadata for m in make_reader(other).iter_metadata()
        ]
    assert read_trace(out).swarm == read_trace(whole).swarm


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 10**6))
def test_cut_off_anywhere(whole, recorded, work, position):
    data = whole.read_bytes()
    cut, out = work / "cut.mcap", work / "recovered.mcap"
    cut.write_bytes(data[: position % len(data)])
    if position % len(data) < 8:
        with pytest.raises(ValueError, match="not an MCAP"):
            recover(cut, out)
        return
    recovered = recover(cut, out)
    kept = messages(out)
    assert len(kept) == recovered
    assert kept == recorded[: len(kept)]
    assert read(cut).closed or read(cut).lost_bytes < 20_000
    if recovered:
        with AnyReader([out]) as reader:
            assert reader.message_count == recovered
    try:
        trace = read_trace(cut)
    except ValueError as error:
        assert "has no swarm" in str(error)
        assert recovered == 0
        return
    assert trace.recorded == recovered
    assert trace.closed or "The trace was not closed: its recorder did not end properly." in summarise(trace).missing


def test_a_damaged_chunk_is_left_out(whole, work):
    data = bytearray(whole.read_bytes())
    chunk = next(i for i in range(20_000, len(data)) if data[i : i + 4] == b"\x28\xb5\x2f\xfd")
    data[chunk + 40] ^= 0xFF
    broken = work / "broken.mcap"
    broken.write_bytes(data)
    recovered = recover(broken, work / "rest.mcap")
    assert 0 < read(broken).lost_bytes < 20_000
    assert len(messages(whole)) - 1000 < recovered < len(messages(whole))


def test_zeros_after_a_power_cut_end_the_trace(whole, work):
    broken = work / "zeros.mcap"
    broken.write_bytes(whole.read_bytes()[:30_000] + bytes(50_000))
    assert recover(broken, work / "rest.mcap")
    assert read(broken).lost_bytes > 49_000


def test_an_attachment_of_a_length_that_no_file_has_is_left_out(whole, work):
    attachment = struct.pack("<BQQQIIQ", Opcode.ATTACHMENT, 32, 0, 0, 0, 0, 2**64 - 1)
    broken, data = work / "broken.mcap", whole.read_bytes()
    end = data.rindex(struct.pack("<BQ", Opcode.DATA_END, 4))
    broken.write_bytes(data[:end] + attachment + data[end:])
    assert recover(broken, work / "rest.mcap") == len(messages(whole))
    assert (read(broken).lost_bytes, read(broken).closed) == (len(attachment), True)


def test_a_file_that_is_not_a_trace_is_refused(work, whole):
    text = work / "text.mcap"
    text.write_text("not a trace at all")
    with pytest.raises(ValueError, match=r"text\.mcap: is not an MCAP file"):
        recover(text, work / "out.mcap")
    assert not (work / "out.mcap").exists()
    with pytest.raises(ValueError, match="the trace itself"):
        recover(whole, whole)
    with pytest.raises(FileNotFoundError):
        recover(work / "nothing.mcap", work / "out.mcap")


def test_records_in_chunks_come_out_singly(whole):
    kinds = [type(record) for record in WholeRecords(whole)]
    assert Message in kinds
    assert Chunk not in kinds


def test_a_chunk_that_grows_without_bound_is_left_out(whole, work):
    """A chunk of some kilobytes says that it has 20 GB."""
    kept, bomb = whole.read_bytes(), zstandard.compress(bytes(LARGEST_CHUNK + 1))
    chunk = Chunk("zstd", bomb, 1, 0, 0, 20_000_000_000)
    builder = RecordBuilder()
    chunk.write(builder)
    record = builder.end()
    hostile = work / "bomb.mcap"
    header = kept.index(b"\x28\xb5\x2f\xfd") - 53  # where the first chunk begins
    assert kept[header] == Opcode.CHUNK
    hostile.write_bytes(kept[:header] + record + kept[header:])
    tracemalloc.start()
    recovered = recover(hostile, work / "rest.mcap")
    assert tracemalloc.get_traced_memory()[1] < 3 * LARGEST_CHUNK
    tracemalloc.stop()
    assert (recovered, read(hostile).closed) == (len(messages(whole)), True)
    assert read(hostile).lost_bytes == len(record)


def test_a_pipe_is_refused_at_once_and_called_one(work):
    os.mkfifo(work / "pipe.mcap")
    with pytest.raises(OSError, match=NO_FILE):
        read_trace(work / "pipe.mcap")
