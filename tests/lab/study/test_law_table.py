"""The table of a comparison of laws: its figures, and its four forms."""

from __future__ import annotations

import csv

import pytest
from flockwire_analysis.report import UNKNOWN
from flockwire_lab.study.file import Study
from flockwire_lab.study.flight import Result
from flockwire_lab.study.law_table import HEADINGS, latex, rows, text, write


def result(point, run, tail, settled, ok=True):
    figures = {
        "formation_tail_m": tail, "settled_s": settled, "path_m": 2.0, "messages_per_s": 100.0, "bytes_per_s": 1234.5,
        "effort_m2_s": 3.14159,
    }  # fmt: skip
    return Result(point, run, run, ok, () if ok else ("formation_tail",), "", 1.0, {}, figures)


@pytest.fixture
def table():
    laws = [{"law": "consensus"}, {"law": "my_law.py:MyLaw", "parameters": {"gain": 0.5}}]
    plan = Study(runs=3, grid={"control": laws})
    results = [result(0, run, 0.001 * (run + 1), 1.0 + run) for run in range(3)]
    results += [result(1, 0, 0.5, None, ok=False), result(1, 1, 0.1, None, ok=False), result(1, 2, 0.2, 9.0)]
    return rows(plan, [*results, result(0, 3, 9.0, 9.0)])  # one beyond the plan


def test_each_law_has_its_figures(table):
    assert table == [
        ("consensus", "3 of 3", "2", "3", "2", "100", "1234", "3.14"),
        ("my_law.py:MyLaw (gain=0.5)", "1 of 3", UNKNOWN, "500", "2", "100", "1234", "3.14"),
    ]


def test_the_files_say_the_same(table, tmp_path):
    found = write(table, tmp_path)
    assert [path.name for path in found] == ["laws.txt", "laws.csv", "laws.tex", "laws.pdf"]
    assert (tmp_path / "laws.txt").read_text() == text(table) + "\n"
    with (tmp_path / "laws.csv").open() as file:
        assert list(csv.reader(file)) == [list(HEADINGS), *map(list, table)]
    assert (tmp_path / "laws.pdf").read_bytes().startswith(b"%PDF")


def test_latex_reads_it(table):
    lines = latex(table).splitlines()
    assert r"my\_law.py:MyLaw (gain=0.5) & 1 of 3 & -- & 500 & 2 & 100 & 1234 & 3.14 \\" in lines
    assert r"\begin{tabular}{lrrrrrrr}" in lines
    assert all(line.count("&") == len(HEADINGS) - 1 for line in lines if line.endswith(r"\\"))


@pytest.mark.long
def test_the_command_flies_all_from_the_same_starts(flockwire, tmp_path):
    line = ("compare-laws", "laws/examples/consensus.toml", "consensus", "consensus,gain=2.0", "extended")
    options = ("--runs", 1, "--duration", 9, "--random-starts", "5x5", "--jobs", 1, "--out", tmp_path / "out")
    done = flockwire(*line, *options)
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out/laws.csv").open() as file:
        one, two, three = list(csv.DictReader(file))
    assert (one["law"], two["law"], three["law"]) == ("consensus", "consensus (gain=2.0)", "extended")
    assert float(two["tail, mm"]) < float(one["tail, mm"])
    assert float(two["messages, 1/s"]) == 0.0 < float(three["messages, 1/s"])
    assert all(0.5 < float(row["path, m"]) < 8.0 for row in (one, two, three))


def test_a_law_that_is_none_is_refused(flockwire, tmp_path):
    out = tmp_path / "out"
    for law, why in (
        ("nothing", "control.law = 'nothing'"),
        ("consensus,gain=x", "must be LAW or LAW,PARAMETER=NUMBER"),
    ):
        done = flockwire("compare-laws", "laws/examples/consensus.toml", law, "--out", out)
        assert done.returncode == 2
        assert why in done.stderr
        assert not out.exists()
