"""The study's page: no text of a swarm or a study becomes markup."""

from __future__ import annotations

import json
from pathlib import Path

from flockwire_sim.study.file import RandomFault, Study
from flockwire_sim.study.findings import QUANTITIES, Findings, GridPointFigures, Quantiles
from flockwire_sim.study.flight import Result
from flockwire_sim.study.page import page
from page_reader import Hostile, Page


def hostile_findings(hostile: Hostile) -> Findings:
    varied = Study(grid={hostile("key"): (hostile("value"),)}, faults=(RandomFault(table={"kind": hostile("fault")}),))
    figures = {quantity.key: Quantiles(1.0, 2.0, None, None, 7) for quantity in QUANTITIES}
    row = GridPointFigures(dict(varied.points[0]), 2, 0, 0.0, 0.0, 0.66, {hostile("failed check"): 2}, figures)
    failed = Result(0, 0, 7, False, ("refused",), hostile("reason"), 0.0, {}, {})
    well = Result(0, 1, 8, True, (), "", 1.5, {}, {})
    return Findings(hostile("swarm"), varied, (row,), (failed, well), (failed, well))


def test_hostile_text_never_becomes_markup(tmp_path: Path) -> None:
    hostile = Hostile()
    findings = hostile_findings(hostile)
    picture = tmp_path / "\"'><b>.png"
    picture.write_bytes(b"picture")
    source = page(findings, [picture])
    read = Page(source)
    assert "<script" not in source
    shown = [text for text in hostile.texts if text in read.text]
    quoted = [text for text in hostile.texts if json.dumps(text) in read.text]
    assert {*shown, *quoted} == set(hostile.texts)
    assert quoted == hostile.texts[:3], "the study itself, as JSON"
    assert read.attributes["img", "alt"] == [picture.stem]
    assert "b" not in read.tags
