"""`flockwire sim`: what it prints, what it writes, how it ends."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from flockwire_analysis.reading import read_trace
from flockwire_operator.cli.main import app
from typer.testing import CliRunner, Result

SWARM = Path(__file__).parents[3] / "examples" / "paper_simulation.toml"


def sim(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["sim", str(SWARM), *map(str, arguments)])


def test_a_flight_leaves_trace_summary_and_report_and_without_a_trace_the_same_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    untraced = sim("--no-trace", "--duration", 10, "--seed", 3)
    assert untraced.exit_code == 0, untraced.output
    assert not list(tmp_path.iterdir())
    result = sim("--duration", 10, "--seed", 3, "--out", tmp_path)
    figures = [line for line in untraced.output.splitlines() if line.startswith("  ")]
    assert figures == [line for line in result.output.splitlines() if line.startswith("  ") and "report:" not in line]
    assert result.exit_code == 0, result.output
    assert "formation error" in result.output
    assert "x real time" in result.output
    assert result.output.splitlines()[-1] == "flockwire: all well"
    checks = [line for line in figures if line.startswith("  checks ")]
    assert len(figures) == 2, figures  # the formation error, and how many checks passed
    assert " passed (--verbose lists them)" in checks[0]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["messages"]["lost"] == 0
    page = (tmp_path / "report.html").read_text()
    assert "virtual time, seed 3" in page
    assert "2026-09-21" not in page  # its clock's date means nothing
    metadata = read_trace(tmp_path / "trace.mcap").metadata
    assert metadata["seed"] == "3"
    assert not {"host", "python", "zenoh"} & metadata.keys()


def test_a_second_flight_into_the_same_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "trace.mcap").write_bytes(b"precious")
    result = sim("--out", tmp_path)
    assert result.exit_code == 2
    assert "there is a trace of another flight" in result.stderr
    assert (tmp_path / "trace.mcap").read_bytes() == b"precious"


def test_a_flight_that_fails_reports_why_last(tmp_path: Path) -> None:
    faults = tmp_path / "faults.toml"
    faults.write_text('[[faults]]\nat = 4.0\nkind = "failure"\ndrone = 2\n')
    result = sim("--no-trace", "--duration", 10, "--faults", faults)
    assert result.exit_code == 1
    assert "the flight failed" in result.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        ('[[faults]]\nat = 4.0\nkind = "kill"\nprocess = "uav7"\n', "there is no such process"),
        (
            '[[faults]]\nat = 4.0\nkind = "kill"\nprocess = "uav1"\n'
            '[[faults]]\nat = 3.0\nkind = "kill"\nprocess = "uav2"\n',
            "must not be before",
        ),
    ],
)
def test_bad_faults_are_refused_in_one_line_and_nothing_is_written(tmp_path: Path, faults: str, said: str) -> None:
    (tmp_path / "faults.toml").write_text(faults)
    result = sim("--out", tmp_path / "out", "--faults", tmp_path / "faults.toml")
    assert result.exit_code == 2
    assert said in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_in_virtual_time_simulated_cameras_stand_for_any_tracker(tmp_path: Path) -> None:
    tracked, faults = tmp_path / "tracked.toml", tmp_path / "faults.toml"
    tracked.write_text(SWARM.read_text() + '\n[gateway]\nsource = "natnet"\n[gateway.twin]\n')
    faults.write_text('[[faults]]\nat = 1.0\nkind = "kill"\nprocess = "tracker-sim"\n')
    line = ["sim", str(tracked), "--no-trace", "--duration", "8"]
    assert "formation error" in CliRunner().invoke(app, line).output
    refused = CliRunner().invoke(app, [*line, "--faults", str(faults)])
    assert refused.exit_code == 2
    assert "'tracker-sim': there is no such process" in refused.output
