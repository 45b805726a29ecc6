"""The report's page: no text of a trace or a probe becomes markup."""

from dataclasses import replace

import pytest
from flockwire.domain.order import Stop
from flockwire.wire.plan import Plan
from flockwire.wire.status import Report
from flockwire_analysis.checks import Check
from flockwire_analysis.figures.drawing import Picture
from flockwire_analysis.latency import Percentiles
from flockwire_analysis.page import page
from flockwire_analysis.reading import read_trace
from flockwire_analysis.rendering import render
from flockwire_analysis.summary import summarise
from jinja2 import UndefinedError
from page_reader import Hostile, Page

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
    for absent in ("What the trace lacks", "key and reason", "Conformance probe", "Emergency stop"):
        assert absent not in read.text


def test_a_value_that_a_template_lacks_is_an_error():
    with pytest.raises(UndefinedError, match="'name' is undefined"):
        render("flockwire_analysis", "report.html")
