"""The report as files: what a person opens, what a script reads."""

import json
import re
import subprocess
import sys
from dataclasses import replace

import pytest
from flockwire_analysis.figures.drawing import Picture
from flockwire_analysis.key_figures import Check
from flockwire_analysis.latency import Percentiles
from flockwire_analysis.reading import read_trace
from flockwire_analysis.report import page, render, write_report
from flockwire_analysis.summary import summarise
from flockwire_core.domain.order import Stop
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report
from flockwire_recorder.trace import TraceWriter, describe
from jinja2 import UndefinedError
from page_reader import Hostile, Page


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
        "graph.png",
    }  # fmt: skip
    assert set(names.values()) == {b"\x89PNG\r\n\x1a\n"}


def test_summary_json_is_the_summary(report):
    summary, out = report
    assert json.loads((out / "summary.json").read_text()) == json.loads(json.dumps(summary.as_json()))
    assert summary.ok


def test_bad_input_is_that_of_the_process_that_had_it(report):
    """Two pilots rejected orders; the gateway had bad frames before and after a restart."""
    _, out = report
    trace = read_trace(out / "trace.mcap")

    def counting(identity, *counts):
        last = trace.vitals[0].last
        status = last._replace(identity=identity, report=last.report._replace(counts=counts))
        return replace(trace.vitals[0], last=status)

    frames, orders = ("frames missing", 3), ("orders rejected", 5)
    processes = (counting("gateway", frames), counting("gateway", frames), counting("uav1", orders))
    trace = replace(trace, vitals=processes)
    summary = summarise(trace)
    assert summary.tracker == {"frames missing": 6}
    text = Page(page(trace, summary, (), None)).text
    assert re.search(r"gateway\s+frames missing\s+6\s+uav1\s+orders rejected\s+5", text)


def test_the_page_needs_nothing_else(report):
    _, out = report
    page = (out / "report.html").read_text()
    read = Page(page)
    images = read.attributes["img", "src"]
    assert len(images) == 12
    assert all(source.startswith("data:image/png;base64,") for source in images)
    assert "://" not in page
    assert "prefers-color-scheme: dark" in page
    for wanted in ("all checks passed", 'name = "paper"  # <by hand>', "uav4", "pose → command", "older than the last"):
        assert wanted in read.text
    assert "{{" not in read.text


@pytest.mark.long
def test_a_trace_without_a_mission_says_what_it_lacks(fly, tmp_path):
    path = fly(begin=-0.5, end=0.2, started=False, lands=False)
    path.write_bytes(path.read_bytes()[:25_000])
    summary = write_report(path, tmp_path / "out")
    words = Page((tmp_path / "out" / "report.html").read_text()).text
    assert not summary.ok
    assert "5 of 16 checks failed" in words
    assert "No mission `start` was recorded" in words
    assert "The trace was not closed" in words
    assert not (tmp_path / "out" / "formation_error.png").exists()


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
    assert list(tmp_path.glob("*.png")) == [tmp_path / "graph.png"]
    Page((tmp_path / "report.html").read_text())


METADATA = ("started", "toml", "version", "zenoh", "python", "host", "seed")


@pytest.fixture(scope="module")
def trace(tmp_path_factory, write_flight):
    path = tmp_path_factory.mktemp("page") / "trace.mcap"
    write_flight(path, begin=-0.5, end=1.0)
    return read_trace(path)


def hostile_trace(trace, hostile):
    vitals = trace.vitals[0]
    last = vitals.last._replace(identity=hostile("identity"), report=Report(hostile("phase")))
    return replace(
        trace,
        plan=Plan(trace.swarm.model_copy(update={"name": hostile("swarm")})),
        metadata={key: hostile(key) for key in METADATA},
        stops=(Stop(0, "world", hostile("stop")), Stop(1, "world", hostile("second stop"))),
        vitals=(replace(vitals, last=last, links=(hostile("link"), hostile("other link"))),),
    )


def hostile_summary(summary, hostile):
    found = Check(hostile("check"), 1.0, None, True, hostile("rule"), hostile("unit"))
    lacking = Check(hostile("failed check"), None, None, False, hostile("rule of it"), reason=hostile("reason"))
    return replace(
        summary,
        checks=(found, lacking),
        missing=(hostile("missing"),),
        latency_ms=summary.latency_ms | {hostile("hop"): Percentiles()},
        messages=replace(summary.messages, rejected_by_key={hostile("key"): 1}),
    )


def hostile_probe(hostile):
    attacker = {key: hostile(key) for key in ("identity", "mode", "links", "refused")}
    counted = {key: [] for key in ("received", "received_expected", "published", "published_expected")}
    return {
        "leaks": [hostile("leak")], "blocked": [hostile("blocked")], "seconds": 1.0, "attackers": [attacker | counted],
    }  # fmt: skip


def test_hostile_text_never_becomes_markup(trace, tmp_path):
    hostile = Hostile()
    (tmp_path / "picture.png").write_bytes(b"picture")
    picture = Picture(tmp_path / "picture.png", hostile("title"), hostile("caption"))
    summary = hostile_summary(summarise(trace), hostile)
    source = page(hostile_trace(trace, hostile), summary, [picture], hostile_probe(hostile))
    read = Page(source)
    assert "<script" not in source
    assert [text for text in hostile.texts if text not in read.text] == []
    assert read.attributes["img", "alt"] == [picture.title]
    assert read.attributes["img", "src"] == ["data:image/png;base64,cGljdHVyZQ=="]


def test_missing_data_leaves_no_empty_table(trace):
    summary = replace(summarise(trace), missing=())
    counts = replace(summary.messages, rejected_by_key={})
    read = Page(page(replace(trace, vitals=()), replace(summary, messages=counts), [], None))
    assert "No process published its status." in read.text
    for absent in ("Missing in the trace", "key and reason", "Conformance probe", "Emergency stop"):
        assert absent not in read.text


def test_a_value_that_a_template_lacks_is_an_error():
    with pytest.raises(UndefinedError, match="'name' is undefined"):
        render("flockwire_analysis", "report.html")
