"""The mutants of lab/bench/mutants/ still apply, and lab/bench/mutants.py judges and counts them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import mutant_columns as columns
import pytest
from first_violation import found
from flockwire_lab.search.campaign import Entry
from flockwire_lab.search.choosing import Candidate
from flockwire_lab.search.corpus import Corpus
from flockwire_lab.search.flight import Judged
from flockwire_lab.search.margin import Margin
from mutant_columns import ROOT, STAGES, Copy, Mutant, Result, commanded, judge, mutants, near, searched, suite
from mutants import Results, figures

EACH = mutants()
ONE = Mutant("one", "a defect", "LICENSE", "Apache License\n", "another licence\n")


@pytest.fixture
def copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Copy:
    """Return a copy of the few files of which the bench needs to know."""
    files = b"LICENSE\0pyproject.toml\0gone.py\0".decode()
    monkeypatch.setattr("mutant_columns.subprocess.run", lambda *_, **__: type("Listed", (), {"stdout": files}))
    return Copy(tmp_path / "tree")


@pytest.mark.parametrize("mutant", [pytest.param(mutant, id=mutant.id) for mutant in EACH])
def test_it_still_applies_to_its_file(mutant: Mutant) -> None:
    text = (ROOT / mutant.file).read_text(encoding="utf-8")
    changed = mutant.applied(text)
    assert changed != text
    if mutant.file.endswith(".py"):
        compile(changed, mutant.file, "exec")


def test_each_has_a_name_of_its_own_and_tests_beside_its_module() -> None:
    assert [name for name, count in Counter(mutant.id for mutant in EACH).items() if count > 1] == []
    assert [mutant.id for mutant in EACH if not (ROOT / near(mutant.file)).is_dir()] == []
    bugs = (ROOT / "lab/model/src/protocol.rs").read_text(encoding="utf-8")
    assert [mutant.model for mutant in EACH if f'"{mutant.model}"' not in bugs and mutant.model] == []


@pytest.mark.parametrize("text", ["", "Apache License\nApache License\n"])
def test_a_text_that_is_not_there_once_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^one: LICENSE has 'Apache License\\n' [02] times, not once$"):
        ONE.applied(text)


@pytest.mark.parametrize(
    ("script", "outcome", "by"),
    [
        ("echo seed 3; grep -q 'Apache License$' LICENSE", "killed", "draws: seed 3"),
        ("grep -q 'another licence' LICENSE", "survived", ""),
        ("echo no such option; exit 2", "failed", "draws: status 2: no such option"),
        ("exit 1", "failed", "draws: status 1: "),
    ],
)
def test_a_command_that_ends_with_status_1_has_found_it(copy: Copy, script: str, outcome: str, by: str) -> None:
    result = judge(copy, ONE, "draws", commanded("draws", ["sh", "-c", script]))
    assert (result.mutant, result.outcome, result.by) == ("one", outcome, by)
    assert "Apache License\n" in (copy.folder / "LICENSE").read_text(encoding="utf-8")


def test_a_command_that_takes_too_long_has_found_it(copy: Copy, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "LONGEST", 0.05)
    result = judge(copy, ONE, "draws", commanded("draws", ["sh", "-c", "cat /dev/zero > /dev/null"]))
    assert (result.outcome, result.by) == ("killed", "draws: time limit")


def test_the_suite_begins_with_the_modules_own_tests_and_ends_with_processes() -> None:
    ladder = next(mutant for mutant in EACH if mutant.file.endswith("pilot/phases.py"))
    stages = {stage.name: stage for stage in suite(STAGES)(ladder)}
    assert tuple(stages) == STAGES
    assert stages["own"].command[-1] == "tests/core/pilot/test_phases.py"
    assert stages["near"].command[-2:] == ["tests/core/pilot", "--ignore=tests/core/pilot/test_phases.py"]
    assert stages["processes"].command[-2:] == ["-m", "integration and not long"]
    assert {stage.name for stage in suite(STAGES)(None)} == {"fast", "flights", "rest", "processes"}
    assert stages["fast"].found("ERROR tests/a.py - ModuleNotFoundError: no module\n1 error") == ""
    assert stages["own"].found("..F\nFAILED tests/a.py::test_b - assert 1 == 2\n1 failed") == "tests/a.py::test_b"


def test_a_search_is_told_which_line_changed(tmp_path: Path) -> None:
    ladder = next(mutant for mutant in EACH if mutant.file.endswith("pilot/ladder.py"))
    (stage,) = searched(tmp_path, 10, ["--seconds", "5"])(ladder)
    place = stage.command[stage.command.index("--changed") + 1]
    file, _, line = place.rpartition(":")
    assert file == ladder.file
    assert (
        ladder.before.strip().splitlines()[0] in (ROOT / file).read_text(encoding="utf-8").splitlines()[int(line) - 1]
    )
    assert "--changed" not in next(searched(tmp_path, 10, [])(None)).command


def test_what_compares_with_a_corpus_flies_it_again_on_the_unchanged_copy(tmp_path: Path) -> None:
    kept, again = searched(tmp_path, 10, ["--seconds", "5"], "change")(None)
    assert kept.command[-4:] == ["--keep", str(tmp_path), "--flights", "10"]
    assert again.command[-6:-2] == ["--corpus", str(tmp_path), "--until", "change"]


@pytest.mark.parametrize(
    ("value", "until", "shown"),
    [
        (-0.1, "violation", "distance: too near at 1.00 s"),
        (0.5, "violation", ""),
        (0.5, "worse", "distance: too near at 1.00 s, margin 0.500, at least 0.700 in 9 flights before"),
        (0.8, "worse", ""),
        (0.8, "change", "flies otherwise than before"),
        (0.9, "change", ""),
    ],
)
def test_a_search_ends_with_a_violation_or_with_less(value: float, until: str, shown: str) -> None:
    def flown(least: float) -> Entry:
        return Entry(0, Candidate((), 0, ""), Judged({"distance": Margin(least, 1.0, "uav1", "too near")}))

    known = Corpus((flown(0.9),), {"distance": 0.7}, 9)
    assert found(flown(value), known, until) == shown


def test_of_several_results_the_newest_counts(tmp_path: Path) -> None:
    file = tmp_path / "results.jsonl"
    for row in (Result("one", "suite", "survived", "", 3600.0), Result("one", "suite", "killed", "near: t", 1800.0)):
        Results(file).add(row)
    with file.open("a") as log:
        log.write('{"mutant": "one", "column": "su')  # the bench was ended
    Results(file).add(Result("two", "draws", "survived", "", 0.0))
    assert len(file.read_text(encoding="utf-8").splitlines()) == 3
    table = figures(Results(file), ["suite", "draws"], [ONE, ONE._replace(id="two")])
    assert [line.split() for line in table.splitlines()] == [
        ["column", "mutants", "killed", "share", "processor", "h", "kills", "per", "h"],
        ["suite", "1", "1", "100%", "0.50", "2"],
        ["draws", "1", "0", "0%", "0.00", "0"],
        ["survived:", "two", "(LICENSE):", "a", "defect"],
    ]
