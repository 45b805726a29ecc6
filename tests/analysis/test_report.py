"""The report as files: what a person opens, what a script reads."""

import json
import subprocess
import sys

import pytest
from flockwire.control.graph import Graph
from flockwire_analysis.graph_picture import graph_picture
from flockwire_analysis.rendering import render
from flockwire_analysis.report import write_report
from flockwire_recorder.trace import TraceWriter, describe
from page_reader import Page


@pytest.fixture(scope="module")
def report(tmp_path_factory, write_flight):
    out = tmp_path_factory.mktemp("report")
    write_flight(out / "trace.mcap", begin=-2.0, end=8.0, noise=0.0005)
    return write_report(out / "trace.mcap", out), out


def test_every_figure_is_drawn(report):
    _, out = report
    names = {path.name: path.read_bytes()[:8] for path in out.glob("*.png")}
    assert set(names) == {
        "trajectories.png", "formation_error.png", "observation_error.png", "convergence.png", "positions.png",
        "estimates.png", "velocities.png", "commands.png", "distances.png", "obstacle_distances.png", "latency.png",
    }  # fmt: skip
    assert set(names.values()) == {b"\x89PNG\r\n\x1a\n"}


def test_summary_json_is_the_summary(report):
    summary, out = report
    assert json.loads((out / "summary.json").read_text()) == json.loads(json.dumps(summary.as_json()))
    assert summary.ok


def test_the_page_needs_nothing_else(report):
    _, out = report
    page = (out / "report.html").read_text()
    read = Page(page)
    images = read.attributes["img", "src"]
    assert len(images) == 11
    assert all(source.startswith("data:image/png;base64,") for source in images)
    assert "://" not in page
    assert "prefers-color-scheme: dark" in page
    for wanted in ("all checks passed", 'name = "paper"  # <by hand>', "uav4", "pose → command", "older than the last"):
        assert wanted in read.text
    assert "{{" not in read.text


def test_a_trace_without_a_mission_says_what_it_lacks(fly, tmp_path):
    path = fly(begin=-0.5, end=0.2, started=False, lands=False)
    path.write_bytes(path.read_bytes()[:25_000])
    summary = write_report(path, tmp_path / "out")
    words = Page((tmp_path / "out" / "report.html").read_text()).text
    assert not summary.ok
    assert "5 of 15 checks failed" in words
    assert "No mission `start` was recorded" in words
    assert "The trace was not closed" in words
    assert not (tmp_path / "out" / "formation_error.png").exists()


def test_the_graph_shows_every_drone_and_edge():
    graph = Graph((1, 2, 3), ((0, 1, 1.0), (1, 2, 0.5), (2, 3, 1.0), (3, 1, 1.0)))
    svg = render("flockwire_analysis", "graph.svg", graph=graph_picture(graph))
    assert svg.count("<circle") == 4
    assert svg.count('marker-end="url(#tip)"') == 4
    assert Page(svg).text.split() == ["0.5", "0", "1", "2", "3"]


def test_matplotlib_is_only_imported_to_draw():
    code = "import sys, flockwire_analysis.report, flockwire_recorder.recover; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_an_empty_trace_and_a_virtual_leader(tmp_path, swarm_of):
    swarm = swarm_of(
        drones=[{"id": 1, "start": [1.0, 0.0, 0.0]}], graph={"edges": [[0, 1]]}, leader={"kind": "virtual"}
    )  # fmt: skip
    TraceWriter(tmp_path / "a.mcap", describe(swarm, "", 0, 0)).close()
    summary = write_report(tmp_path / "a.mcap", tmp_path)
    assert [check.name for check in summary.checks if not check.ok] == [
        "obstacle clearance", "speed", "fence", "formation settled", "formation tail", "observation tail",
            "lost drones",
        "landed", "control rate",
    ]  # fmt: skip
    assert "No status of uav1 was recorded." in summary.missing
    assert list(tmp_path.glob("*.png")) == []
    Page((tmp_path / "report.html").read_text())
