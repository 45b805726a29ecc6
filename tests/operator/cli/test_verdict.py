import os
import subprocess
import sys

import pytest
from flockwire_operator.cli.verdict import conclude
from flockwire_operator.station.conduct import LEFT_TO_THEMSELVES
from recorded_flights import Flight, record


def test_a_flight_that_was_ended_before_its_take_off_has_one_sentence_and_no_checks(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Flight, "missions", lambda _: iter(()))
    monkeypatch.setattr("flockwire_analysis.report.write_files", lambda *_: None)
    record(tmp_path / "trace.mcap", begin=-0.5, end=0.5)
    assert conclude("", tmp_path) == 1
    printed = capsys.readouterr()
    assert "ok " not in printed.out
    assert printed.err.splitlines()[-1] == "flockwire: the flight failed: it ended before take-off"


def test_a_trace_that_still_grows_is_not_judged(tmp_path, capsys):
    record(tmp_path / "trace.mcap", begin=-0.5, end=0.5)
    assert conclude(LEFT_TO_THEMSELVES, tmp_path) == 1
    assert not (tmp_path / "report.html").exists()
    printed = capsys.readouterr()
    assert str(tmp_path / "trace.mcap") in printed.out
    assert printed.err == f"flockwire: the flight failed: {LEFT_TO_THEMSELVES}\n"


def test_a_report_that_cannot_be_drawn_does_not_hide_the_verdict(tmp_path, monkeypatch, capsys):
    def draw(*_):
        raise ValueError("no such back end")

    monkeypatch.setattr("flockwire_analysis.report.write_files", draw)
    record(tmp_path / "trace.mcap", begin=-0.5, end=0.5)
    assert conclude("", tmp_path) == 1
    assert capsys.readouterr().err.splitlines()[-1].endswith("the report cannot be written: no such back end")


@pytest.mark.long
def test_figures_do_not_depend_on_the_back_end_of_a_notebook(tmp_path):
    record(tmp_path / "trace.mcap")
    done = subprocess.run(
        [sys.executable, "-m", "flockwire_operator", "report", tmp_path / "trace.mcap"],
        env=os.environ | {"MPLBACKEND": "module://no_such_package.backend_inline"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert "Traceback" not in done.stderr
    assert f"  report: {tmp_path / 'report.html'}" in done.stdout.splitlines()
