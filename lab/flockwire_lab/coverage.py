"""Coverage of meaning: how many flights of a campaign reached each mark, and which marks none reached.

The marks are those of flockwire/domain/marks.txt.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Self


@cache
def declared() -> tuple[str, ...]:
    """Return all marks, each once."""
    text = (files("flockwire_core.domain") / "marks.txt").read_text(encoding="utf-8")
    return tuple(text.splitlines())


class Coverage:
    """Adds up the marks of flights."""

    def __init__(self) -> None:
        self.flights = 0
        self.reached: Counter[str] = Counter()  # flights that reached a mark
        self.times: Counter[str] = Counter()

    @classmethod
    def of(cls, flights: Iterable[Mapping[str, int]]) -> Self:
        """Return the coverage of flights by the marks that each reached."""
        coverage = cls()
        for marks in flights:
            coverage.add(marks)
        return coverage

    def add(self, marks: Mapping[str, int]) -> None:
        """Add a flight that reached `marks` so many times each."""
        self.flights += 1
        self.reached.update(marks.keys())
        self.times.update(marks)

    def rarer(self, than: int) -> tuple[str, ...]:
        """Return the marks that fewer flights reached."""
        return tuple(mark for mark in declared() if self.reached[mark] < than)

    @property
    def undeclared(self) -> tuple[str, ...]:
        """The marks that were reached, but are not declared."""
        return tuple(sorted(self.reached.keys() - set(declared())))

    @property
    def line(self) -> str:
        """How many of the marks were reached, in a few words."""
        return f"{len(declared()) - len(self.rarer(1))} of {len(declared())} reached in {self.flights} flights"

    def table(self) -> Iterator[str]:
        """Yield the table, line by line, then the marks that were never reached."""
        yield f"{'mark':64}{'flights':>9}{'times':>11}"
        for mark in (*declared(), *self.undeclared):
            yield f"{mark:64}{self.reached[mark]:>9}{self.times[mark]:>11}"
        yield self.line
        yield from (f"never reached: {mark}" for mark in self.rarer(1))
        yield from (f"not declared: {mark}" for mark in self.undeclared)
