"""The key figures as people read them."""

from dataclasses import replace

import pytest
from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from flockwire_operator.cli.verdict import brief_figures, key_figures


@pytest.fixture(scope="module")
def summary(good_flight):
    """Return the summary of a flight in which all is well."""
    return summarise(read_trace(good_flight))


def test_errors_latency_and_each_check_have_a_line(summary):
    found = list(key_figures(summary))
    assert [line[:17].rstrip() for line in found[:3]] == ["observation error", "formation error", "pose to command"]
    tail = summary.formation_error_m.max_tail
    assert f"{1000 * tail:.1f} mm at most" in found[1]
    assert [line[5:] for line in found if line.startswith("ok   ")] == [c.sentence() for c in summary.checks if c.ok]
    assert not [line for line in found if line.startswith("FAIL")]


def test_in_brief_it_is_the_error_and_what_failed(summary):
    judged = [check for check in summary.checks if check.judged]
    error, passed = brief_figures(summary)
    assert error == list(key_figures(summary))[1]
    assert passed.split()[1:5] == [str(len(judged)), "of", str(len(judged)), "passed"]
    failed = replace(judged[0], ok=False)
    _, fail, missing, passed = brief_figures(replace(summary, checks=(failed, *judged[1:]), missing=("no poses",)))
    assert (fail, missing) == (f"FAIL {failed.sentence()}", "missing: no poses")
    assert passed.split()[1] == str(len(judged) - 1)


def test_what_is_not_known_reports_it(summary):
    unsettled = replace(summary.formation_error_m, max_tail=None, settled_s=None)
    found = list(
        key_figures(replace(summary, formation_error_m=unsettled, missing=("uav3 has no poses",), left_out=("uav2",)))
    )
    assert found[1].split() == ["formation", "error", "not", "measured"]
    assert found[3].split() == ["left", "out", "uav2"]
    assert found[-1] == "missing: uav3 has no poses"
