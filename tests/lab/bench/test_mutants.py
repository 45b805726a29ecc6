"""The mutants of lab/bench/mutants.toml still apply, and tests find every seventh."""

from __future__ import annotations

from pathlib import Path

import pytest
from mutants import ROOT, Mutant, copy_tree, killer, mutants

pytestmark = [pytest.mark.long, pytest.mark.sources]


@pytest.mark.parametrize("mutant", [pytest.param(mutant, id=mutant.defect) for mutant in mutants()])
def test_it_still_applies_to_its_file(mutant: Mutant) -> None:
    text = (ROOT / mutant.file).read_text(encoding="utf-8")
    assert mutant.applied(text) != text


def test_tests_find_them(tmp_path: Path) -> None:
    environment = copy_tree(tmp_path)
    assert [mutant.defect for mutant in mutants()[::7] if not killer(mutant, tmp_path, environment)] == []
