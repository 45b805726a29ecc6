"""A uniform grid: finding the bodies near one drone costs the same in a swarm of any size."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor

from flockwire.domain.vector import Vector

Cell = tuple[int, int]


class Vicinity:
    """The `places` (m, by any key), sorted into upright columns of `reach` x `reach` m: few drones share one."""

    def __init__(self, places: Mapping[int, Vector], reach: float) -> None:
        self._reach = reach
        self._order = {key: rank for rank, key in enumerate(places)}
        self._cells: dict[Cell, list[int]] = {}
        for key, place in places.items():
            self._cells.setdefault(self._cell(place), []).append(key)

    def round(self, position: Vector) -> list[int]:
        """Return the keys of all places that may be within reach of `position`, in the order of the mapping."""
        cells, (a, b) = self._cells, self._cell(position)
        found: list[int] = []
        for i in (a - 1, a, a + 1):
            for j in (b - 1, b, b + 1):
                if (i, j) in cells:
                    found += cells[i, j]
        return sorted(found, key=self._order.__getitem__) if len(found) > 1 else found

    def _cell(self, place: Vector) -> Cell:
        return (floor(place[0] / self._reach), floor(place[1] / self._reach))
