"""Gaps of the recording, distinguished from missing publications by the publishers' counts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key

from flockwire_analysis.phases import Span, at
from flockwire_analysis.recorded import Trace, is_repeated
from flockwire_analysis.series import Floats, Series


class Gap(NamedTuple):
    """The longest time, s, in which messages of a topic were published but none recorded, with `key` and `begin`."""

    length: float = 0.0
    key: Key | None = None
    begin: int = 0  # Unix ns


def longest_gap(trace: Trace, judged: bool = True) -> Gap:
    """Return the longest gap in any topic whose messages are not repeated, and are judged or (False) are not."""
    periodic = (key for key in trace.series if not is_repeated(key.kind) and (key in trace.plan.judged) == judged)
    return max((_longest(key, trace.series[key]) for key in periodic), key=lambda gap: gap.length, default=Gap())


def control_rate(trace: Trace, number: int, spans: list[Span]) -> float | None:
    """Return the share of due steps within `spans` that the pilot of drone `number` made, None without any due.

    A step is due for each pose, at most `control.rate_hz` per s. Messages are counted by their sequence numbers, which
    include unrecorded ones. Extra steps of a span do not count for another.
    """
    rate = trace.swarm.control.rate_hz
    poses, commands = trace.of("pose", number), trace.of("command", number)
    due = np.array([span.length * rate for span in spans])
    if len(poses):
        due = np.minimum(due, _published(poses, rate, spans))
    made = np.minimum(due, _published(commands, rate, spans))
    return float(made.sum() / due.sum()) if due.any() else None


def where(trace: Trace, gap: Gap) -> str:
    """Return topic and time of a gap as text."""
    topic = f"/{trace.plan.text(gap.key)}" if gap.key is not None else "no topic"
    return f"in {topic}, from {at(trace, gap.begin)} on"


def beside(trace: Trace) -> str:
    """Return what is missing of the messages of optional processes, empty if nothing is."""
    gap = longest_gap(trace, judged=False)
    if not gap.length and not trace.lost_beside:
        return ""
    longest = f", up to {gap.length:.1f} s {where(trace, gap)}" if gap.length else ""
    return (
        f"messages that a flight can do without were not recorded: {trace.lost_beside}{longest}; no check counts them"
    )


def _longest(key: Key, series: Series) -> Gap:
    missed = np.diff(series.sequences) > 1
    lengths = np.where(missed, np.diff(series.published), 0)
    if not len(lengths):
        return Gap()
    at = int(np.argmax(lengths))
    return Gap(float(lengths[at]) / SECOND, key, int(series.published[at]))


def _published(series: Series, rate: int, spans: list[Span]) -> Floats:
    """Return the number of messages published within each of `spans`; a gap counts at most as many as fit."""
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
