"""Where to look next: MAP-Elites with CMA-ES (CMA-ME; Fontaine et al., 2020), of the library ribs.

The archive has a cell for each reaction, fault and phase of a least margin. One emitter varies the flights in it for
breadth (Vassiliades and Mouret, 2018). The other, CMA-ES (Hansen, 2016), goes down where margins get less, and restarts
from another flight of the archive.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flockwire_core.wire.phase import Phase
from ribs.archives import GridArchive
from ribs.emitters import EvolutionStrategyEmitter, IsoLineEmitter

from flockwire_lab.search.drawing import SEARCHED_KINDS
from flockwire_lab.search.flight import Judged, scaled
from flockwire_lab.search.record import REACTIONS
from flockwire_lab.search.space import BATCH, Candidate

AXES = (("", *REACTIONS), ("", *SEARCHED_KINDS), ("", *Phase))  # of the archive


class Search:
    """Looks for the least margins in the unit cube of `size` dimensions: each emitter asks in turn."""

    def __init__(self, size: int, seed: int) -> None:
        beginning = 48  # random flights before it varies them
        spread = 0.1  # standard deviation at the start of CMA-ES
        self._seed, self._turns = seed, 0
        counts = [len(axis) for axis in AXES]
        self.archive = GridArchive(
            solution_dim=size, dims=counts, ranges=[(-0.5, count - 0.5) for count in counts], seed=seed
        )
        self._first = list(np.random.default_rng(seed).random((beginning, size)))
        self._asked = np.empty((0, size))  # what the emitter asked for, which may be outside the cube
        middle = np.full(size, 0.5)
        self._emitters = (
            IsoLineEmitter(self.archive, x0=middle, iso_sigma=0.02, line_sigma=0.2, batch_size=BATCH, seed=seed),
            EvolutionStrategyEmitter(self.archive, x0=middle, sigma0=spread, ranker="obj", batch_size=BATCH, seed=seed),
        )

    def ask(self) -> list[Candidate]:
        """Return the next flights."""
        self._turns += 1
        if self._first:
            points, self._first = np.array(self._first[:BATCH]), self._first[BATCH:]
        else:
            points = self._asked = np.asarray(self._emitters[self._turns % 2].ask())
        inside = np.round(points.clip(0.0, 1.0), 9)
        return [Candidate(tuple(point), self._seed + self._turns) for point in inside.tolist()]

    def tell(self, asked: Sequence[Candidate], found: Sequence[Judged]) -> None:
        """Learn the results of what was asked, or of a corpus."""
        refused = -1e6  # objective of what is not a flight
        objectives = np.array([-scaled(judged) if judged.margins else refused for judged in found])
        cells = np.array([cell(judged) for judged in found])
        added = self.archive.add(np.array([candidate.point for candidate in asked]), objectives, cells)
        if len(self._asked) == len(asked):  # not of a corpus, and not cut off by `runs`
            self._emitters[self._turns % 2].tell(self._asked, objectives, cells, added)


def cell(judged: Judged) -> tuple[int, ...]:
    """Return the cell of the archive; what is not on an axis is in its first place."""
    return tuple(axis.index(name) if name in axis else 0 for axis, name in zip(AXES, judged.cell, strict=True))
