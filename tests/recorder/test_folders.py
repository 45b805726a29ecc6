from datetime import timedelta

import pytest
from flockwire_core import clock
from flockwire_recorder.folders import SAME_FLIGHT, dated_folder, newest_folder
from flockwire_recorder.trace import TraceWriter, describe

T0 = 1_790_000_000_000_000_000


@pytest.fixture
def record(tmp_path, swarm_of):
    """Return what leaves a trace in a folder, closed or cut off."""

    def record(folder, closed, name="trace.mcap", started=T0):
        (tmp_path / folder).mkdir(exist_ok=True)
        writer = TraceWriter(tmp_path / folder / name, describe(swarm_of(), "", 0, started))
        writer.close() if closed else writer.flush()

    return record


def test_a_recorder_that_is_started_has_a_folder_named_by_the_time(tmp_path, swarm_of, record):
    now = clock.local()
    fresh = tmp_path / f"{now:%Y%m%d-%H%M%S}"
    assert dated_folder(tmp_path, swarm_of(), now) == fresh
    record("20200101-000000", closed=True)
    assert dated_folder(tmp_path, swarm_of(), now) == fresh


def test_one_that_comes_back_after_a_crash_continues_in_the_newest_folder(tmp_path, swarm_of, record):
    record("20200101-000000", closed=False)
    record("20200101-100000", closed=True)
    record("20200101-100000", closed=False, name="trace-2.mcap")
    now = clock.local()
    assert dated_folder(tmp_path, swarm_of(), now) == tmp_path / "20200101-100000"
    later = now + timedelta(seconds=SAME_FLIGHT + 60)
    assert dated_folder(tmp_path, swarm_of(), later) == tmp_path / f"{later:%Y%m%d-%H%M%S}"


def test_folders_without_a_trace_are_ignored(tmp_path):
    (tmp_path / "20200101-000000").mkdir()
    assert newest_folder(tmp_path) is None
    assert newest_folder(tmp_path / "nowhere") is None


def test_the_newest_folder_is_that_of_the_last_flight_whatever_its_name(tmp_path, record):
    record("demo-friday", closed=True)
    record("20261123-120000", closed=True, started=T0 + 3600 * 10**9)
    (tmp_path / "unreadable").mkdir()
    (tmp_path / "unreadable/trace.mcap").write_bytes(b"")
    assert newest_folder(tmp_path) == tmp_path / "20261123-120000"
