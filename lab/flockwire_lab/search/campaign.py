"""A whole search: chooses flights, has them flown, keeps each in a ledger, and continues one that was stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from random import Random
from typing import TYPE_CHECKING

from flockwire_core.swarm.wording import InputError

from flockwire_lab.search.flight import Judged, Order
from flockwire_lab.search.space import BATCH, Candidate, SearchPlan, Space
from flockwire_lab.study.ledger import Ledger

if TYPE_CHECKING:
    from flockwire_lab.search.seeking import Search  # the extra `study`


@dataclass(frozen=True, slots=True)
class Entry:
    """One flight of a search: its number, what was asked, and what it showed."""

    number: int
    asked: Candidate
    judged: Judged


Fly = Callable[[Iterable[Order]], Iterator[tuple[int, Judged]]]


def conduct(
    plan: SearchPlan,
    space: Space,
    ledger: Ledger[Entry],
    flown: Fly,
    step: Callable[[Entry], bool],
    corpus: Sequence[Candidate] = (),
) -> None:
    """Fly what the ledger lacks; `step` gets each flight, those of the ledger too, and returns whether to end.

    A search flies the `corpus` first.

    Raises InputError if the ledger's flights are not those that the plan asks for.
    """
    seeker, waiting, number = _chooser(plan, space), list(corpus), 0
    while number < plan.runs:
        batch, waiting = (waiting[:BATCH], waiting[BATCH:]) if waiting else (seeker.ask(), [])
        asked = dict(enumerate(batch[: plan.runs - number], start=number))
        found: dict[int, Judged] = {}
        for entry in _entries(asked, space, ledger, flown):
            found[entry.number] = entry.judged
            if step(entry):
                return
        seeker.tell(list(asked.values()), [found[place] for place in asked])
        number += len(asked)


def _entries(asked: dict[int, Candidate], space: Space, ledger: Ledger[Entry], flown: Fly) -> Iterator[Entry]:
    """Yield what was asked: flights of the ledger, those that cannot be flown, then the others as they end."""
    known = {entry.number: entry for entry in ledger.results if entry.number in asked}
    orders: list[Order] = []
    for place, candidate in asked.items():
        if (entry := known.get(place)) is None:
            try:
                orders.append((place, space.case(candidate.point, candidate.seed)))
                continue
            except InputError as error:
                entry = Entry(place, candidate, Judged({}, refused=str(error).replace("\n", "; ")))
                ledger.add(entry)
        if entry.asked != candidate:
            raise InputError(f"flight {place} of the folder is not the one that this search asks for")
        yield entry
    for place, judged in flown(orders) if orders else ():
        entry = Entry(place, asked[place], judged)
        ledger.add(entry)
        yield entry


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


def _chooser(plan: SearchPlan, space: Space) -> Draws | Search:
    """Return what chooses flights by the results of earlier ones; equal results, equal choices."""
    if plan.method == "draws":
        return Draws(space.size, plan.seed)
    from flockwire_lab.search.seeking import Search  # noqa: PLC0415  (the extra `study`)

    return Search(space.size, plan.seed)
