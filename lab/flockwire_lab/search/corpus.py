"""A corpus: flights of an earlier search to fly first, ordered by how much each adds per second that it takes.

What an earlier search reached, a change of the code may have broken. Choosing tests by what they add is the "additional
greedy" order of test case prioritisation (Rothermel et al., 2001). Virtual flights are repeatable: by the same code one
shows the same again to the last digit. So the record of a corpus is an oracle beside the properties (regression testing
with recorded results: the "golden master"; Feathers, 2004). It shows a change, not that the change is wrong.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import inf
from pathlib import Path

from flockwire_core.swarm.wording import InputError
from pydantic import TypeAdapter, ValidationError

from flockwire_lab.search.campaign import Entry
from flockwire_lab.search.flight import USUAL, Judged, scaled, worst_of
from flockwire_lab.search.space import Candidate
from flockwire_lab.study.ledger import RUNS


@dataclass(frozen=True)
class Corpus:
    """The `flights` of an earlier search to fly first, and the `least` margin of each property in `count` of it."""

    flights: Sequence[Entry] = ()
    least: Mapping[str, float] = field(default_factory=dict)
    count: int = 0

    @cached_property
    def asked(self) -> list[Candidate]:
        """What a search asks for that flies them first."""
        return [entry.asked for entry in self.flights]

    def has(self, entry: Entry) -> bool:
        """Return whether a flight of a search that flies `asked` first is one of it."""
        return entry.number < len(self.flights) and entry.asked == self.asked[entry.number]

    def changed(self, entry: Entry) -> bool:
        """Return whether a flight shows another thing than in the earlier search."""
        return self.has(entry) and entry.judged != self.flights[entry.number].judged

    def worse(self, entry: Entry) -> list[str]:
        """Return, in words, of which properties the margin of a flight of it is less than in any flight before."""
        lines = []
        for name, margin in entry.judged.margins.items() if self.has(entry) else ():
            if margin.value < min(self.least.get(name, inf), USUAL.get(name, 1.0)):
                before = f"at least {self.least[name]:.3f}" if name in self.least else "none"
                what = f"{name}: {margin.what} at {margin.at:.2f} s, margin {margin.value:.3f}"
                lines.append(f"{what}, {before} in {self.count} flights before")
        return lines


@dataclass(frozen=True, slots=True)
class Again:
    """How many flights of a corpus were flown again, which of them changed, and what is worse, by number."""

    flown: int
    changed: list[int]
    worse: dict[int, list[str]]

    @classmethod
    def of(cls, known: Corpus, flights: Iterable[Entry]) -> Again:
        """Return what the flights of a search that flies `known` first show of it."""
        again = [entry for entry in flights if known.has(entry)]
        worse = {entry.number: lines for entry in again if (lines := known.worse(entry))}
        return cls(len(again), [entry.number for entry in again if known.changed(entry)], worse)

    def lines(self) -> Iterator[str]:
        """Yield it in words, nothing without a corpus."""
        if self.flown:
            changed, worse = len(self.changed), len(self.worse)
            yield f"of {self.flown} flights of the corpus {changed} changed, {worse} are worse than all before"
        yield from (f"{number}: {line}" for number, lines in self.worse.items() for line in lines)


def read(folder: Path, size: int) -> Corpus:
    """Return the corpus of the search in `folder`, in the order of `chosen`.

    Raises InputError for one of another space than `size` values.
    """
    try:
        found = flown(folder)
    except (OSError, UnicodeDecodeError, ValidationError):
        raise InputError(f"--corpus = {folder}: must be the folder of a search") from None
    if other := {len(entry.asked.point) for entry in found} - {size}:
        raise InputError(f"--corpus = {folder}: its flights have {min(other)} values, those of this search {size}")
    judged = {entry.number: entry.judged for entry in found}
    least = {name: judged[number].margins[name].value for name, number in worst_of(judged).items()}
    return Corpus(tuple(chosen(found)), least, len(found))


def flown(folder: Path) -> list[Entry]:
    """Return the flights of a search, without one that it is writing.

    Raises OSError, UnicodeDecodeError and pydantic's ValidationError.
    """
    *lines, _ = (folder / RUNS).read_text(encoding="utf-8").split("\n")
    entry = TypeAdapter(Entry)
    return [entry.validate_json(line) for line in lines]


def chosen(found: Sequence[Entry]) -> Iterator[Entry]:
    """Yield flights, each of which shows something that none before it shows: those that violate a property first."""
    shows = {entry.number: shown(entry.judged) for entry in found if entry.judged.margins}
    rest = [entry for entry in found if entry.number in shows]
    seen: set[Hashable] = set()
    while rest:
        best = max(rest, key=lambda one: _worth(one.judged, shows[one.number] - seen))
        seen |= shows[best.number]
        yield best
        rest = [entry for entry in rest if shows[entry.number] - seen]


def _worth(judged: Judged, new: set[Hashable]) -> tuple[bool, float, float]:
    return bool(judged.violations), len(new) / max(judged.seconds, 1.0), -scaled(judged)


def shown(judged: Judged) -> set[Hashable]:
    """Return what a flight shows: its cell, events by number, margins by size, reactions by which came before."""
    step = 0.1  # of a margin: values within it are taken for the same
    return {
        judged.cell,
        *((event, count.bit_length()) for event, count in judged.events.items()),
        *((name, margin.value // step) for name, margin in judged.margins.items()),
        *pairwise(["", *judged.reactions]),
    }
