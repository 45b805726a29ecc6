"""The study's page: no text of a swarm or a study becomes markup."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from flockwire_analysis.figures.drawing import Picture
from flockwire_core.swarm.model import Swarm
from flockwire_lab.study.figures import draw, over, varied_keys
from flockwire_lab.study.file import RandomFault, Study
from flockwire_lab.study.findings import Findings, GridPointFigures, Quantiles, label
from flockwire_lab.study.flight import QUANTITIES, Result
from flockwire_lab.study.page import page
from page_reader import Hostile, Page
from pydantic import JsonValue


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
    source = page(findings, [Picture(picture, hostile("title"), hostile("caption"))])
    read = Page(source)
    assert "<script" not in source
    shown = [text for text in hostile.texts if text in read.text]
    quoted = [text for text in hostile.texts if json.dumps(text) in read.text]
    assert {*shown, *quoted} == set(hostile.texts)
    assert quoted == hostile.texts[:3], "the study itself, as JSON"
    assert read.attributes["img", "alt"] == [hostile.texts[-2]]
    assert "b" not in read.tags


def test_a_table_in_the_grid_is_named_by_what_is_in_it() -> None:
    point = {"control": {"law": "my_law:Go", "parameters": {"gain": 2.0}}, "observer.gain": 3, "formations": {}}
    assert label(point) == "law=my_law:Go, gain=2.0, gain=3, formations={}"
    assert label({}) == "all runs"


def rows(values: list[JsonValue], laws: tuple[str, ...] = ("extended", "paper")) -> Findings:
    """Return findings over `values` of a gain, with two laws: the median falls with the gain, a bound is unknown."""
    swept = Study(grid={"control.law": laws, "control.formation_gain": tuple(values)})
    found = []
    for number, point in enumerate(swept.points):
        quantiles = Quantiles(1.0 / (1 + number), 2.0 / (1 + number), None, None, 7)
        figures = {one.key: quantiles if one.key != "settled_s" else None for one in QUANTITIES}
        found.append(GridPointFigures(dict(point), 2, 2, 1.0, 0.3, 1.0, {}, figures))
    return Findings("swarm", swept, tuple(found), (), ())


@pytest.mark.long
def test_a_parameter_with_three_numbers_has_curves_by_the_other_keys(
    tmp_path: Path, make_swarm: Callable[..., Swarm]
) -> None:
    findings = rows([3.0, 1.0, 2])
    assert varied_keys(findings) == ["control.formation_gain"]
    lines = over(findings, "control.formation_gain").axes[0].get_lines()
    assert [line.get_label() for line in lines] == ["law=extended", "law=paper"]
    assert [list(line.get_xdata()) for line in lines] == [[1.0, 2.0, 3.0]] * 2
    assert list(lines[0].get_ydata()) == [1.0 / 2, 1.0 / 3, 1.0]
    written = {picture.path.name: picture for picture in draw(findings, make_swarm(), tmp_path, pdf=True)}
    assert set(written) == {"success.png", "distributions.png", "over_control.formation_gain.png"}
    pdf = tmp_path / "over_control.formation_gain.pdf"
    assert pdf.read_bytes().startswith(b"%PDF")


def test_two_values_words_and_truths_are_no_curve() -> None:
    assert varied_keys(rows([1.0, 2.0])) == []
    assert varied_keys(rows(["a", "b", "c"])) == []
    assert varied_keys(rows([True, False, 1.0])) == []
