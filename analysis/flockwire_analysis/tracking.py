"""Positions of the drones, their references, and the errors between them: observation and formation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise

import numpy as np
from flockwire_core.domain.time import SECOND

from flockwire_analysis.phases import Span, formation_phases, offsets
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Booleans, Floats, Integers, Series

SETTLED_BELOW = 0.1  # m
SETTLED_FOR = 2 * SECOND  # ns
SILENCE = SECOND // 2  # ns without a sample after which an error counts as unknown


@dataclass(frozen=True, slots=True)
class Errors:
    """One follower's error: `stamps` in Unix ns, `values` in m; its own place then, in m, if that is known."""

    stamps: Integers
    values: Floats
    places: Floats | None = None


@dataclass(frozen=True, slots=True)
class ErrorFigures:
    """Largest and root-mean-square error over the tail, m, and when it settled, s from the phase's start."""

    max_tail: float | None = None
    rms_tail: float | None = None
    settled_s: float | None = None


def interpolated(series: Series, stamps: Integers) -> Floats:
    """Return the first three columns of `series`, linear between its stamps, at `stamps` (Unix ns).

    NaN outside, and in gaps longer than SILENCE.
    """
    if not len(series):
        return np.full((len(stamps), 3), np.nan)
    base = series.stamps[0]
    known, wanted = (series.stamps - base) / SECOND, (stamps - base) / SECOND
    columns = [np.interp(wanted, known, series.values[:, axis], np.nan, np.nan) for axis in range(3)]
    result = np.stack(columns, axis=1)
    if len(series) > 1:
        after = np.clip(np.searchsorted(series.stamps, stamps), 1, len(series) - 1)
        first, last = series.stamps[after - 1], series.stamps[after]
        result[(last - first > SILENCE) & (stamps != first) & (stamps != last)] = np.nan
    return result


def places(trace: Trace, number: int, times: Integers) -> Floats:
    """Return x_i in m, one row for each of `times` (Unix ns), NaN if it is unknown."""
    return interpolated(trace.positions(number), times)


def own_places(trace: Trace, number: int, times: Integers) -> Floats:
    """Return x_0 + h_i of a follower in m, one row for each of `times` (Unix ns), NaN if it is unknown."""
    return offsets(trace, number, times) + interpolated(trace.leader, times)


def references(trace: Trace, number: int, times: Integers) -> Floats:
    """Return the place x_0 + h_i of a follower in m, NaN outside the formation phases; of any other drone: unknown."""
    if number not in trace.followers:
        return np.full((len(times), 3), np.nan)
    wanted = own_places(trace, number, times)
    wanted[~in_formation(trace, times)] = np.nan
    return wanted


def velocities(
    positions: Callable[[Trace, int, Integers], Floats], trace: Trace, number: int, times: Integers
) -> Floats:
    """Return the velocity of a drone's `positions` (`places` or `references`) in m/s, from displacements over 50 ms."""
    half = SECOND // 40  # ns, of the window of a velocity
    return (positions(trace, number, times + half) - positions(trace, number, times - half)) * (SECOND / (2 * half))


def in_formation(trace: Trace, times: Integers) -> Booleans:
    """Return which of `times` are in a formation phase, not hovering or landing."""
    within = np.zeros(len(times), np.bool_)
    for phase in formation_phases(trace):
        within |= phase.span.holds(times)
    return within


def observation_errors(trace: Trace) -> dict[int, Errors]:
    """Return |eta_i - x_0| of each follower at the stamps of its estimates, where the leader's position is known."""
    leader, estimates = trace.leader, {i: trace.of("estimate", i) for i in trace.followers}
    return {i: _errors(e.stamps, e.values[:, :3] - interpolated(leader, e.stamps)) for i, e in estimates.items()}


def formation_errors(trace: Trace) -> dict[int, Errors]:
    """Return |x_i - h_i - x_0| of each follower at the stamps of its positions, from the formation's time 0.

    Without a leader from which places count it is what the law measures itself, by the follower's statuses.
    """
    if trace.swarm.sole_leader is None:
        reported = {i: trace.of("status", i) for i in trace.followers}
        known = {i: in_formation(trace, each.stamps) & (each.values[:, 0] >= 0.0) for i, each in reported.items()}
        return {i: Errors(each.stamps[known[i]], each.values[known[i], 0]) for i, each in reported.items()}
    found = {}
    for i in trace.followers:
        x = trace.positions(i)
        offset, leader = offsets(trace, i, x.stamps), interpolated(trace.leader, x.stamps)
        found[i] = _errors(x.stamps, x.values - offset - leader, offset + leader)
    return found


def figures(errors: dict[int, Errors], phase: Span, judged: dict[int, Errors]) -> ErrorFigures:
    """Judge the errors of all followers within `phase`, settling by those `judged`; None if one has no samples."""
    tail = phase.tail()
    tails = [error.values[tail.holds(error.stamps)] for error in errors.values()]
    settled = settling_time(judged, phase)
    if not all(len(values) for values in tails):
        return ErrorFigures(settled_s=settled)
    values = np.concatenate(tails)
    return ErrorFigures(float(values.max()), float(np.sqrt(np.mean(values**2))), settled)


def worst(figures_of_phases: Sequence[ErrorFigures]) -> ErrorFigures:
    """Return the worst of several phases, each figure by itself; None if one of them is None, or there is none."""
    found = [astuple(figures) for figures in figures_of_phases]
    return ErrorFigures(*(largest(values) for values in zip(*found, strict=True)))


def largest(values: Sequence[float | None]) -> float | None:
    """Return the largest of `values`, None if one of them is None, or there is none."""
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else None


def largest_tail(errors: dict[int, Errors], steady: dict[int, Errors], phase: Span, settled: Span) -> float | None:
    """Return the largest error in the tail of `phase`, m, by the samples in `steady`; None as in `figures`.

    A follower without such samples is judged by those in the span `settled`, and without any by its whole tail.
    """
    tail = phase.tail()
    found = []
    for number, error in errors.items():
        chosen = ((steady[number], tail), (steady[number], settled), (error, tail))
        samples = (each.values[span.holds(each.stamps)] for each, span in chosen)
        found.append(next((float(values.max()) for values in samples if len(values)), None))
    return largest(found)


def longest_off(errors: dict[int, Errors], steady: dict[int, Errors], span: Span, limit: float) -> float:
    """Return the longest time in `span`, s, for which a follower was more than `limit` (m) off its place.

    Samples that are not in `steady` are ignored.
    """
    longest = 0
    for number, error in errors.items():
        within = span.holds(error.stamps)
        stamps = error.stamps[within]
        off = (error.values[within] > limit) & np.isin(stamps, steady[number].stamps)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], off, [False]])))
        runs = stamps[edges[1::2] - 1] - stamps[edges[::2]]
        longest = max([longest, *runs.tolist()])
    return longest / SECOND


def settling_time(errors: dict[int, Errors], phase: Span) -> float | None:
    """Return the start, s after that of `phase`, of the first stretch in which all errors are below the threshold.

    The stretch lasts at least SETTLED_FOR; a follower without samples for SILENCE does not count as settled.
    """
    blocked = [_unsettled(error, phase) for error in errors.values()]
    bad = np.unique(np.concatenate([*blocked, [phase.end]]))
    samples = np.unique(np.concatenate([error.stamps for error in errors.values()]))
    if bad[0] - phase.begin >= SETTLED_FOR:
        return 0.0
    for last, following in pairwise(bad):
        if following - last >= SETTLED_FOR:
            begin = samples[np.searchsorted(samples, last, "right")]
            if following - begin >= SETTLED_FOR:
                return float(begin - phase.begin) / SECOND
    return None


def _unsettled(error: Errors, phase: Span) -> Integers:
    """Return stamps at which the error is too large or, closer than SETTLED_FOR, unknown."""
    within = phase.holds(error.stamps)
    stamps, values = error.stamps[within], error.values[within]
    edges = np.concatenate([[phase.begin], stamps, [phase.end]])
    silences = np.flatnonzero(np.diff(edges) > SILENCE)
    gaps = [np.append(np.arange(edges[k], edges[k + 1], SILENCE), edges[k + 1]) for k in silences]
    return np.concatenate([stamps[values >= SETTLED_BELOW], *gaps]).astype(np.int64)


def _errors(stamps: Integers, error: Floats, places: Floats | None = None) -> Errors:
    values = norms(error)
    known = np.isfinite(values)
    return Errors(stamps[known], values[known], None if places is None else places[known])


def norms(vectors: Floats) -> Floats:
    """Return the length of each row."""
    return np.asarray(np.sqrt(np.sum(vectors**2, axis=1)))
