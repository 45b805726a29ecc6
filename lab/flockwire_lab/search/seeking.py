"""Where to look next: an archive of the worst flight of each kind for breadth, CMA-ES on one property for depth.

The two take turns. The archive (MAP-Elites; Mouret and Clune, 2015) has a cell for each rung, fault and phase of a
least margin, and varies the flights in it. CMA-ES (Hansen, 2016) minimises the margin of one property. It restarts
with the next property, from the worst flight found for it or, every other time, anywhere. Each round of all properties
has twice the population of the one before (IPOP; Auger and Hansen, 2005).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np
from cma import CMAEvolutionStrategy
from flockwire_analysis.series import Floats
from flockwire_core.wire.phase import Phase
from ribs.archives import GridArchive
from ribs.emitters import IsoLineEmitter

from flockwire_lab.search.choosing import BATCH, Candidate, scaled
from flockwire_lab.search.drawing import SEARCHED_KINDS
from flockwire_lab.search.flight import Judged
from flockwire_lab.search.rungs import RUNGS

PROPERTIES = (
    "distance", "silence", "rung", "fence", "formation", "clearance", "stop", "contact", "distance", "order", "down",
    "over", "tail",
)  # fmt: skip
AXES = (("", *RUNGS), ("", *SEARCHED_KINDS), ("", *Phase))  # of the archive
BEGINNING = 48  # random ones before it varies its flights
GENERATIONS = 12  # of one run of CMA-ES, at most
NEAR, FAR = 0.12, 0.3  # standard deviations at its start: from a known flight, from anywhere
REFUSED = 1e6  # objective of what is not a flight


class Search:
    """Looks for the least margins in the unit cube of `size` dimensions."""

    def __init__(self, size: int, seed: int) -> None:
        self._size, self._seed, self._turns = size, seed, 0
        counts = [len(axis) for axis in AXES]
        self.archive = GridArchive(
            solution_dim=size, dims=counts, ranges=[(-0.5, count - 0.5) for count in counts], seed=seed
        )
        first = np.random.default_rng(seed).random((BEGINNING, size))
        self._emitter = IsoLineEmitter(
            self.archive, iso_sigma=0.05, line_sigma=0.2, initial_solutions=first, lower_bounds=np.zeros(size),
            upper_bounds=np.ones(size), batch_size=BATCH, seed=seed,
        )  # fmt: skip
        self._runs = 0  # of CMA-ES
        self._depth: CMAEvolutionStrategy | None = None
        self._first: Floats = np.empty((0, size))
        self._worst: dict[str, tuple[float, tuple[float, ...]]] = {}  # by property: margin and point

    def ask(self) -> list[Candidate]:
        """Return the next flights."""
        self._turns += 1
        if self._turns <= BEGINNING // BATCH or self._turns % 2:
            points, focus = list(self._broad()), ""
        else:
            points, focus = self._deep(), self._focus
        seed = self._seed + (self._runs if focus else self._turns)
        return [Candidate(tuple(round(float(x), 9) for x in point), seed, focus) for point in points]

    def tell(self, asked: Sequence[Candidate], found: Sequence[Judged]) -> None:
        """Learn the results of what was asked."""
        for candidate, judged in zip(asked, found, strict=True):
            self._remember(candidate, judged)
        flown = [(c, j) for c, j in zip(asked, found, strict=True) if j.margins]
        if flown:
            self.archive.add(
                np.array([c.point for c, _ in flown]),
                np.array([-scaled(j) for _, j in flown]),
                np.array([cell(j) for _, j in flown]),
            )
        depth = self._depth
        if asked and asked[0].focus and depth is not None and len(asked) == depth.popsize:
            values = [objective(judged, asked[0].focus) for judged in found]
            depth.tell([np.array(candidate.point) for candidate in asked], values)
            if depth.countiter >= GENERATIONS or depth.stop() or max(values) - min(values) < 1e-9:
                self._depth = None

    def _remember(self, candidate: Candidate, judged: Judged) -> None:
        for name, margin in judged.margins.items():
            if margin.value < self._worst.get(name, (inf,))[0]:
                self._worst[name] = (margin.value, candidate.point)

    def _broad(self) -> Floats:
        if self._turns <= BEGINNING // BATCH:
            if self._turns == 1:
                self._first = np.asarray(self._emitter.ask())
            return self._first[(self._turns - 1) * BATCH : self._turns * BATCH]
        return np.asarray(self._emitter.ask())

    @property
    def _focus(self) -> str:
        return PROPERTIES[(self._runs - 1) % len(PROPERTIES)]

    def _deep(self) -> list[Floats]:
        if self._depth is None:
            self._runs += 1
            self._depth = self._restarted()
        return list(self._depth.ask())

    def _restarted(self) -> CMAEvolutionStrategy:
        """Return a run of CMA-ES for the next property that any flight so far had."""
        while self._focus not in self._worst:
            self._runs += 1
        chance = np.random.default_rng(self._seed + self._runs)
        rounds = (self._runs - 1) // len(PROPERTIES)
        near = (self._runs + rounds) % 2
        begin = np.array(self._worst[self._focus][1]) if near else chance.random(self._size)
        options: dict[str, Any] = {
            "bounds": [0.0, 1.0], "seed": self._seed + self._runs + 1, "verbose": -9,
            "popsize": (8 + int(3 * np.log(self._size))) * 2 ** min(rounds, 4),
        }  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return CMAEvolutionStrategy(np.clip(begin, 0.01, 0.99), NEAR if near else FAR, options)


def objective(judged: Judged, focus: str) -> float:
    """Return what CMA-ES minimises: the margin of a property, large where the flight does not tell of it."""
    if not judged.margins:
        return REFUSED
    margin = judged.margins.get(focus)
    return REFUSED / 1e3 if margin is None else margin.value


def cell(judged: Judged) -> tuple[int, ...]:
    """Return the cell of the archive; what is not on an axis is in its first place."""
    return tuple(axis.index(name) if name in axis else 0 for axis, name in zip(AXES, judged.cell, strict=True))
