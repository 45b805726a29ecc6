"""What the recorder missed, distinguished from what was never published by the publishers' own counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flockwire.domain.time import SECOND
from flockwire.wire.keys import Key

from flockwire_analysis.phases import Span
from flockwire_analysis.recorded import Trace, is_repeated
from flockwire_analysis.series import Floats, Series


@dataclass(frozen=True, slots=True)
class Gap:
    """The longest time, s, for which messages of a topic were published and none recorded; which `key`, and `begin`."""

    length: float = 0.0
    key: Key | None = None
    begin: int = 0  # Unix ns


def longest_gap(trace: Trace) -> Gap:
    """Return the longest gap in any topic whose messages are not repeated."""
    periodic = (key for key in trace.series if not is_repeated(key.kind))
    return max((_longest(key, trace.series[key]) for key in periodic), key=lambda gap: gap.length, default=Gap())


def control_rate(trace: Trace, number: int, spans: list[Span]) -> float | None:
    """Return the share of the steps due within `spans` that the pilot of drone `number` made, None without any due.

    Due is a step for each pose, no more than `control.rate_hz` asks for. Messages are counted by their sequence
    numbers: those that only the recorder missed were published. A span's further steps make up for none of another's.
    """
    rate = trace.swarm.control.rate_hz
    poses, commands = trace.of("pose", number), trace.of("command", number)
    due = np.array([span.length * rate for span in spans])
    if len(poses):
        due = np.minimum(due, _published(poses, rate, spans))
    made = np.minimum(due, _published(commands, rate, spans))
    return float(made.sum() / due.sum()) if due.any() else None


def where(trace: Trace, gap: Gap) -> str:
    """Return in which topic a gap is, and when, as text."""
    topic = f"/{trace.plan.text(gap.key)}" if gap.key is not None else "no topic"
    return f"in {topic}, {(gap.begin - trace.begin) / SECOND:.1f} s after its start"


def _longest(key: Key, series: Series) -> Gap:
    missed = np.diff(series.sequences) > 1
    lengths = np.where(missed, np.diff(series.published), 0)
    if not len(lengths):
        return Gap()
    at = int(np.argmax(lengths))
    return Gap(float(lengths[at]) / SECOND, key, int(series.published[at]))


def _published(series: Series, rate: int, spans: list[Span]) -> Floats:
    """Return how many messages were published within each of `spans`; a gap counts for no more than fit into it."""
    if not len(series):
        return np.zeros(len(spans))
    order = np.argsort(series.published, kind="stable")
    published = series.published[order]
    times = (published - published[0]) / SECOND
    fitting = np.rint(np.diff(times) * rate)
    counted = np.clip(np.diff(series.sequences[order]), 1, np.maximum(fitting, 1))
    edges = np.array([[span.begin, span.end] for span in spans], np.int64).reshape(-1, 2) - published[0]
    inside = np.interp(edges / SECOND, times, np.concatenate([[0.0], np.cumsum(counted)]))
    return np.asarray(inside[:, 1] - inside[:, 0])
