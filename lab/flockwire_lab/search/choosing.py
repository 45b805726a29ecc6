"""What chooses the flights of a search, and what is the worst of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from random import Random

from flockwire_lab.search.flight import Judged

BATCH = 16  # flights of a turn
USUAL = {"distance": 2.0, "clearance": 2.0, "contact": 0.3, "rung": 0.23}  # margins where all is well; 1 of the others


@dataclass(frozen=True, slots=True)
class Candidate:
    """A point of the unit cube to fly with `seed`."""

    point: tuple[float, ...]
    seed: int


class Draws:
    """Draws each flight independently: what a search must beat."""

    def __init__(self, size: int, seed: int) -> None:
        self._size, self._chance, self._seeds = size, Random(f"draws {seed}"), count(seed)  # noqa: S311

    def ask(self) -> list[Candidate]:
        """Return random points, each with its own seed."""
        return [
            Candidate(tuple(round(self._chance.random(), 9) for _ in range(self._size)), next(self._seeds))
            for _ in range(BATCH)
        ]

    def tell(self, asked: Sequence[Candidate], found: Sequence[Judged]) -> None:
        """Draws learn nothing."""


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
