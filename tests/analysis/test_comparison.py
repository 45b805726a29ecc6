"""Flights and groups beside each other: means, intervals and paired tests equal those of the textbook and of scipy."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from flockwire_analysis.comparison import (
    QUANTITIES,
    Group,
    as_csv,
    as_latex,
    as_text,
    comparison,
    difference_of,
    mean_of,
)
from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from scipy import stats

FIRST, OTHER = (4.1, 5.0, 3.8, 4.4, 4.9), (3.6, 4.8, 3.1, 4.5, 4.0)
DISTANCE = [quantity.name for quantity in QUANTITIES].index("smallest distance")


@pytest.fixture(scope="module")
def summary(good_flight):
    return summarise(read_trace(good_flight))


@pytest.fixture
def groups(summary):
    """Return two groups of five flights that differ in their smallest distance."""

    def group(name, distances):
        flights = {f"seed {k}": replace(summary, min_distance_uav_m=d) for k, d in enumerate(distances)}
        return Group(name, flights)

    return [group("paper", FIRST), group("my_law", OTHER)]


def test_a_mean_has_student_s_interval():
    count, mean, low, high, _ = mean_of(FIRST)
    assert (mean, count) == (pytest.approx(np.mean(FIRST)), 5)
    expected = stats.t.interval(0.95, 4, loc=np.mean(FIRST), scale=stats.sem(FIRST))
    assert (low, high) == pytest.approx(expected)
    assert mean_of([2.0]) == (1, 2.0, None, None, None)
    assert mean_of([]) is None


def test_a_difference_is_that_of_the_pairs():
    first, other = (dict(enumerate(values)) for values in (FIRST, OTHER))
    found, expected = difference_of(first, other), stats.ttest_rel(OTHER, FIRST)
    assert found.mean == pytest.approx(np.mean(OTHER) - np.mean(FIRST))
    assert found.p == pytest.approx(expected.pvalue)
    assert (found.low, found.high) == pytest.approx(tuple(expected.confidence_interval(0.95)))
    assert difference_of(first, {0: 1.0, 9: 2.0}) is None  # one pair only
    assert difference_of(first, {**other, 0: None}).size == 4
    equal = difference_of(first, first)
    assert (equal.mean, equal.p) == (0.0, None)


def test_the_table_of_two_groups(groups):
    rows = comparison(groups)
    head, *lines = as_text(groups, rows)
    assert head.split() == ["paper", "my_law", "my_law", "-", "paper"]
    assert {len(line) for line in lines} == {len(head)}
    p = stats.ttest_rel(OTHER, FIRST).pvalue
    assert lines[DISTANCE].startswith("smallest distance, m")
    assert lines[DISTANCE].endswith(f"p = {p:.2g}")
    assert lines[0].endswith("equal")  # the same formation error in all flights


def test_single_flights_have_a_column_each_without_differences(summary):
    unknown = replace(summary, min_distance_obstacle_m=None)
    groups = [Group("first", {"": summary}), Group("another-flight", {"": unknown})]
    head, *lines = as_text(groups, comparison(groups))
    assert head.split() == ["first", "another-flight"]
    assert {len(line) for line in lines} == {len(head)}
    assert lines[-1].split() == ["failed", "checks", "0", "0"]
    assert next(line for line in lines if line.startswith("to an obstacle")).endswith("unknown")
    assert "p =" not in as_latex(groups, comparison(groups))


def test_csv_and_latex_have_the_same_numbers(groups):
    rows = comparison(groups)
    table = list(csv.DictReader(as_csv(groups, rows).splitlines()))
    assert [row["quantity"] for row in table] == [quantity.name for quantity in QUANTITIES]
    assert float(table[DISTANCE]["my_law - paper: difference"]) == rows[DISTANCE].differences[0].mean
    assert float(table[DISTANCE]["paper: low"]) == rows[DISTANCE].means[0].low
    latex = as_latex(groups, rows)
    assert latex.startswith("\\begin{tabular}{lrrr}\n\\toprule\n & paper & my\\_law & my\\_law $-$ paper \\\\")
    assert f"$-${-rows[DISTANCE].differences[0].mean:.4g} [" in latex
    assert latex.count("\\\\") == len(QUANTITIES) + 1


def test_a_name_of_any_signs_is_text_in_latex(groups):
    (odd, other) = (replace(groups[0], name="a{b}^c~d\\e_f"), groups[1])
    latex = as_latex([odd, other], comparison([odd, other]))
    assert " & a\\{b\\}\\textasciicircum{}c\\textasciitilde{}d\\textbackslash{}e\\_f & " in latex


def test_a_folder_is_a_group_and_flights_in_equal_places_are_pairs(
    flockwire, summary, good_flight, tmp_path, monkeypatch
):
    drawn = []
    flight = read_trace(good_flight)
    monkeypatch.setattr("flockwire_analysis.reading.read_trace", lambda _: flight)
    monkeypatch.setattr("flockwire_analysis.summary.summarise", lambda _: summary)
    monkeypatch.setattr("flockwire_analysis.figures.comparison.compare", lambda *given: drawn.append(given) or ())
    for group in ("paper", "extended"):
        for seed in "12":
            (tmp_path / group / seed).mkdir(parents=True)
            (tmp_path / group / seed / "trace.mcap").touch()
    done = flockwire("compare", tmp_path / "paper", tmp_path / "extended", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0].split() == ["paper", "extended", "extended", "-", "paper"]
    (row, *_) = csv.DictReader((tmp_path / "out/comparison.csv").open())
    assert (row["extended: flights"], row["extended - paper: pairs"]) == ("2", "2")
    assert [len(group) for group in drawn[0][0]] == [2, 2]
    traces = [tmp_path / "paper" / seed / "trace.mcap" for seed in "12"] + [tmp_path / "extended/1/trace.mcap"]
    done = flockwire("compare", *traces, "--out", tmp_path / "out")
    assert done.stdout.splitlines()[0].split() == ["paper/1", "paper/2", "extended/1", "all"]
    (tmp_path / "empty").mkdir()
    done = flockwire("compare", tmp_path / "empty", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "has no trace.mcap" in done.stderr
