"""A flight at equal steps: positions, places in the formation and errors of all drones, and its worst moments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from flockwire_core.domain.time import SECOND

from flockwire_analysis.phases import airborne, formation_phases, origin
from flockwire_analysis.recorded import Trace
from flockwire_analysis.separation import nearest_surface
from flockwire_analysis.series import Booleans, Floats, Integers
from flockwire_analysis.tracking import interpolated, norms, places, references

Values = Mapping[tuple[int, ...], Floats]  # of one drone, or of a pair


class Moment(NamedTuple):
    """What was worst at `stamp` (Unix ns), as text, and whom it concerns."""

    stamp: int
    text: str
    drones: tuple[int, ...]


class Sampled(NamedTuple):
    """The flight at `stamps` (Unix ns), equal steps before and after `zero`: a row for each, NaN where it is unknown.

    `zero` is time 0 of the first formation, else the trace's begin.
    `positions` and `references` (the place x_0 + h_i, while a formation is flown) are in m, shape n x 3, by drone;
    `observation` is |eta_i - x_0| in m of each follower.
    """

    trace: Trace
    zero: int
    stamps: Integers
    positions: Mapping[int, Floats]
    references: Mapping[int, Floats]
    observation: Mapping[int, Floats]

    def formation(self, number: int) -> Floats:
        """Return |x_i - h_i - x_0| of a drone, m; the leader has none."""
        return norms(self.positions[number] - self.references[number])


def sampled(trace: Trace, most: int) -> Sampled:
    """Return a flight from shortly before its first order to the trace's end, in at most `most` steps or so."""
    ms = SECOND // 1000
    finest = SECOND // 50  # ns between two samples
    before = 2 * SECOND  # ns that are sampled before the first order
    begin = max(trace.begin, min(trace.end, airborne(trace).begin) - before)  # an order's stamp may be later than all
    zero = origin(trace)
    step = max(finest, -(-(trace.end - begin) // most // ms) * ms)
    first = zero - (zero - begin) // step * step
    stamps = np.arange(first, max(first, trace.end) + 1, step, dtype=np.int64)
    numbers = sorted(trace.plan.pilot)
    leader = interpolated(trace.leader, stamps)
    return Sampled(
        trace,
        zero,
        stamps,
        {number: places(trace, number, stamps) for number in numbers},
        {number: references(trace, number, stamps) for number in numbers},
        {i: norms(interpolated(trace.of("estimate", i), stamps) - leader) for i in trace.followers},
    )


def worst_moments(flight: Sampled) -> Iterator[Moment]:
    """Yield when drones were nearest to each other and to obstacles, and the largest errors in the judged tails.

    Only what is between the first order and a stop counts. The values are those of the samples.
    """
    trace, within, tails = flight.trace, airborne(flight.trace).holds(flight.stamps), np.zeros(len(flight.stamps), bool)
    for phase in formation_phases(trace):
        tails |= phase.span.tail().holds(flight.stamps)
    x, obstacles = flight.positions, trace.swarm.obstacles
    apart: Values = {(i, j): norms(x[i] - x[j]) for i, j in combinations(trace.flying, 2)}
    clear: Values = {(i,): nearest_surface(x[i], obstacles) for i in trace.flying if obstacles}
    formation: Values = {(i,): -1000.0 * flight.formation(i) for i in trace.followers}
    observation: Values = {(i,): -1000.0 * flight.observation[i] for i in trace.followers}
    yield from _lowest(flight, apart, within, "distance between drones: {:.2f} m")
    yield from _lowest(flight, clear, within, "distance to an obstacle: {:.2f} m")
    yield from _lowest(flight, formation, tails, "formation error in a tail: {:.1f} mm", -1.0)
    yield from _lowest(flight, observation, tails, "observation error in a tail: {:.1f} mm", -1.0)


def _lowest(flight: Sampled, values: Values, within: Booleans, text: str, sign: float = 1.0) -> Iterator[Moment]:
    """Yield the moment of the smallest of the known values `within`, if there is one; the text has `sign` times it."""
    masked = {whom: np.where(within & np.isfinite(one), one, np.inf) for whom, one in values.items()}
    whom = min(masked, key=lambda one: float(masked[one].min(initial=np.inf)), default=None)
    if whom is not None and np.isfinite(masked[whom]).any():
        at = int(np.argmin(masked[whom]))
        names = " and ".join(flight.trace.plan.pilot[number] for number in whom)
        yield Moment(int(flight.stamps[at]), f"{text.format(sign * float(masked[whom][at]))}, {names}", whom)
