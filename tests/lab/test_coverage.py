"""The table of marks: it names what the code marks, no more and no less, and what a campaign has not reached."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import flockwire_agent
import flockwire_core
import flockwire_leader
import flockwire_tello
import flockwire_twins.kinematics
import pytest
from flockwire_lab.coverage import Coverage, declared

PACKAGES = (flockwire_core, flockwire_agent, flockwire_twins.kinematics, flockwire_leader, flockwire_tello)
LISTED = (files("flockwire_core.domain") / "marks.txt").read_text().splitlines()
GROUPS = {mark.split(": ")[0] for mark in declared()}


def spelled() -> Iterator[str]:
    """Yield a regular expression for each text of the code that begins like a mark."""
    for package in PACKAGES:
        for file in Path(str(package.__file__)).parent.rglob("*.py"):
            text = file.read_text()
            if not any(f'"{group}: ' in text for group in GROUPS):
                continue
            tree = ast.parse(text)
            inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
            for node in ast.walk(tree):
                parts = node.values if isinstance(node, ast.JoinedStr) else [node]
                if id(node) in inner or not all(isinstance(part, ast.Constant | ast.FormattedValue) for part in parts):
                    continue
                text = "".join(
                    re.escape(part.value) if isinstance(part, ast.Constant) and isinstance(part.value, str) else ".+?"
                    for part in parts
                )
                if text.replace("\\", "").split(": ")[0] in GROUPS and ": " in text.replace("\\", ""):
                    yield text


@pytest.fixture(scope="module")
def patterns() -> set[str]:
    return set(spelled())


def test_each_mark_of_the_code_is_declared(patterns: set[str]) -> None:
    assert [text for text in patterns if not any(re.fullmatch(text, mark) for mark in declared())] == []


def test_each_declared_mark_is_in_the_code(patterns: set[str]) -> None:
    assert [mark for mark in declared() if not any(re.fullmatch(text, mark) for text in patterns)] == []


def test_a_mark_is_declared_once() -> None:
    assert len(set(LISTED)) == len(LISTED)


def test_a_campaign_counts_flights_and_names_what_it_never_reached() -> None:
    coverage = Coverage()
    coverage.add({"director: takes off": 1, "guard: a wall": 7})
    coverage.add({"director: takes off": 1, "no such mark": 1})
    assert (coverage.flights, coverage.reached["director: takes off"], coverage.times["guard: a wall"]) == (2, 2, 7)
    assert "guard: a wall" in coverage.rarer(2)
    assert "guard: a wall" not in coverage.rarer(1)
    assert coverage.undeclared == ("no such mark",)
    lines = list(coverage.table())
    assert "never reached: director: lands" in lines
    assert "not declared: no such mark" in lines
    assert "never reached: director: takes off" not in lines
