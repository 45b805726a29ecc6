"""Who is near whom: a uniform grid, so that looking round one drone costs the same in a swarm of any size."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import floor

from flockwire.control.vector import Vector

Cell = tuple[int, int, int]


class Vicinity:
    """The `places` (m, by any key), sorted into cubes of `reach` m."""

    def __init__(self, places: Mapping[int, Vector], reach: float) -> None:
        self._reach = reach
        self._order = {key: rank for rank, key in enumerate(places)}
        self._cells: dict[Cell, list[int]] = {}
        for key, place in places.items():
            self._cells.setdefault(self._cell(place), []).append(key)

    def round(self, position: Vector) -> list[int]:
        """Return the keys of all places that may be within reach of `position`, in the order of the mapping."""
        found = [key for cell in _block(self._cell(position)) for key in self._cells.get(cell, ())]
        return sorted(found, key=self._order.__getitem__)

    def _cell(self, place: Vector) -> Cell:
        reach = self._reach
        return (floor(place[0] / reach), floor(place[1] / reach), floor(place[2] / reach))


def _block(cell: Cell) -> Iterator[Cell]:
    a, b, c = cell
    for i in (a - 1, a, a + 1):
        for j in (b - 1, b, b + 1):
            for k in (c - 1, c, c + 1):
                yield (i, j, k)
