"""The latency of each hop, by the publishers' times: exact on one machine, else as good as their clocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats, Series

CAPTURE = "capture"  # exposure time: the stamp of a pose
HOPS = (f"{CAPTURE}_to_pose", "pose_to_estimate", "pose_to_command")


@dataclass(frozen=True, slots=True)
class Percentiles:
    """Median and 99th percentile, ms; None if nothing was measured."""

    p50: float | None = None
    p99: float | None = None


def latencies(trace: Trace, hop: str) -> Floats:
    """Return the delays of all drones over `hop` (of HOPS) in ms.

    A delay lasts from the publication of a message to that of the first answer with the same stamp; for a pose it
    starts at the stamp, its exposure time.
    """
    cause, answer = hop.split("_to_")
    if cause == CAPTURE:
        answers = [trace.of(answer, number) for number in trace.flying]
        return np.concatenate([(series.published - series.stamps) / 1e6 for series in answers])
    numbers = sorted({*trace.swarm.leaders, *trace.flying})
    return np.concatenate([_delays(trace.of(cause, number), trace.of(answer, number)) for number in numbers])


def percentiles(delays: Floats) -> Percentiles:
    """Return the percentiles of `delays`, in their unit."""
    if not len(delays):
        return Percentiles()
    p50, p99 = np.percentile(delays, [50, 99])
    return Percentiles(float(p50), float(p99))


def _delays(causes: Series, answers: Series) -> Floats:
    """Return ms from each cause to its answer; the first of several with one stamp counts."""
    begins, begun = _first_published(causes)
    ends, ended = _first_published(answers)
    _, i, j = np.intersect1d(begins, ends, assume_unique=True, return_indices=True)
    return np.asarray((ended[j] - begun[i]) / 1e6, np.float64)


def _first_published(series: Series) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], ...]:
    order = np.lexsort((series.published, series.stamps))
    stamps, first = np.unique(series.stamps[order], return_index=True)
    return stamps, series.published[order][first]
