"""What chooses the flights of a search: independent draws, or a corpus first and then what is made after it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Protocol

from flockwire_lab.search.flight import Judged

BATCH = 16  # flights of a turn
USUAL = {"distance": 2.0, "clearance": 2.0, "contact": 0.3, "rung": 0.23}  # margins where all is well; 1 of the others


@dataclass(frozen=True, slots=True)
class Candidate:
    """A point of the unit cube to fly with `seed`; `focus` is the property that it was chosen for."""

    point: tuple[float, ...]
    seed: int
    focus: str


class Chooser(Protocol):
    """Chooses flights by the results of earlier ones. Equal results, equal choices."""

    def ask(self) -> list[Candidate]:
        """Return the next flights, which may fly at the same time."""

    def tell(self, asked: Sequence[Candidate], found: Sequence[Judged]) -> None:
        """Learn the results of what was asked."""


class Draws:
    """Draws each flight independently: what a search must beat."""

    def __init__(self, size: int, seed: int) -> None:
        self._size, self._chance, self._count, self._seed = size, Random(f"draws {seed}"), 0, seed  # noqa: S311

    def ask(self) -> list[Candidate]:
        """Return random points, each with its own seed."""
        first, self._count = self._count, self._count + BATCH
        return [
            Candidate(tuple(round(self._chance.random(), 9) for _ in range(self._size)), self._seed + first + k, "")
            for k in range(BATCH)
        ]

    def tell(self, asked: Sequence[Candidate], found: Sequence[Judged]) -> None:
        """Draws learn nothing."""


class KnownFirst:
    """Chooses the flights of a corpus, then as what `after` makes, which learns what they showed."""

    def __init__(self, corpus: Sequence[Candidate], after: Callable[[], Chooser]) -> None:
        self._corpus, self._make = list(corpus), after
        self._after: Chooser | None = None  # made when it is needed: its libraries take seconds to load
        self._told: list[tuple[Sequence[Candidate], Sequence[Judged]]] = []

    def ask(self) -> list[Candidate]:
        """Return the next flights."""
        if self._corpus:
            known, self._corpus = self._corpus[:BATCH], self._corpus[BATCH:]
            return known
        if self._after is None:
            self._after = self._make()
            for asked, found in self._told:
                self._after.tell(asked, found)
        return self._after.ask()

    def tell(self, asked: Sequence[Candidate], found: Sequence[Judged]) -> None:
        """Learn the results of what was asked."""
        if self._after is None:
            self._told.append((asked, found))
        else:
            self._after.tell(asked, found)


def scaled(judged: Judged) -> float:
    """Return the least margin, each relative to that of a flight without faults."""
    return min(margin.value / USUAL.get(name, 1.0) for name, margin in judged.margins.items())


def worst_of(found: Mapping[int, Judged]) -> dict[str, int]:
    """Return the number of the flight with the least margin of each property."""
    worst: dict[str, int] = {}
    for number, judged in sorted(found.items()):
        for name, margin in judged.margins.items():
            if name not in worst or margin.value < found[worst[name]].margins[name].value:
                worst[name] = number
    return worst
