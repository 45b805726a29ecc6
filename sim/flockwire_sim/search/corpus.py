"""A corpus: flights of an earlier search to fly first, ordered by how much each adds per second that it takes.

What an earlier search reached, a change of the code may have broken. Choosing tests by what they add is the "additional
greedy" order of test case prioritisation (Rothermel et al., 2001).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

from pydantic import TypeAdapter, ValidationError

from flockwire_sim.search.campaign import Entry
from flockwire_sim.search.choosing import Candidate, scaled
from flockwire_sim.search.flight import Judged
from flockwire_sim.study.file import StudyError
from flockwire_sim.study.ledger import RUNS

STEP = 0.1  # of a margin: values within it are taken for the same


def read(folder: Path, size: int, near: Mapping[str, int] = MappingProxyType({})) -> list[Candidate]:
    """Return the corpus of the search in `folder`, in the order of `chosen`.

    Raises StudyError for one of another space than `size` values.
    """
    try:
        found = flown(folder)
    except (OSError, UnicodeDecodeError, ValidationError):
        raise StudyError(f"--corpus = {folder}: must be the folder of a search") from None
    if other := {len(entry.asked.point) for entry in found} - {size}:
        raise StudyError(f"--corpus = {folder}: its flights have {min(other)} values, those of this search {size}")
    return [Candidate(entry.asked.point, entry.asked.seed, "") for entry in chosen(found, near)]


def flown(folder: Path) -> list[Entry]:
    """Return the flights of a search, without one that it is writing.

    Raises OSError, UnicodeDecodeError and pydantic's ValidationError.
    """
    *lines, _ = (folder / RUNS).read_text(encoding="utf-8").split("\n")
    entry = TypeAdapter(Entry)
    return [entry.validate_json(line) for line in lines]


def chosen(found: Sequence[Entry], near: Mapping[str, int] = MappingProxyType({})) -> Iterator[Entry]:
    """Yield flights, each of which shows something that none before it shows: those that violate a property first.

    Then come those that reach a mark `near` a change (changed.py), by its weight.
    """
    shows = {entry.number: shown(entry.judged) for entry in found if entry.judged.margins}
    nears = {entry.number: max((near.get(mark, 0) for mark in entry.judged.marks), default=0) for entry in found}
    rest = [entry for entry in found if entry.number in shows]
    seen: set[Hashable] = set()
    while rest:
        best = max(rest, key=lambda one: _worth(one.judged, nears[one.number], shows[one.number] - seen))
        rest.remove(best)
        if new := shows[best.number] - seen:
            seen |= new
            yield best
        rest = [entry for entry in rest if shows[entry.number] - seen]


def _worth(judged: Judged, near: int, new: set[Hashable]) -> tuple[bool, int, float, float]:
    return bool(judged.violations), near, len(new) / max(judged.seconds, 1.0), -scaled(judged)


def shown(judged: Judged) -> set[Hashable]:
    """Return what a flight shows: its cell, marks by how often, margins by how large, rungs by which came before."""
    rungs = [rung for rung, _ in sorted(judged.rungs.items(), key=lambda item: item[1])]
    return {
        judged.cell,
        *((mark, count.bit_length()) for mark, count in judged.marks.items()),
        *((name, margin.value // STEP) for name, margin in judged.margins.items()),
        *pairwise(["", *rungs]),
    }
