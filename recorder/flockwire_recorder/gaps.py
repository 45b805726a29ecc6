"""What the recorder missed, distinguished from what was never published by the publishers' own counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flockwire.nanoseconds import BILLION
from flockwire.wire.keys import ROWS, Delivery, Key

from flockwire_recorder.phases import Span
from flockwire_recorder.recorded import Trace
from flockwire_recorder.series import Floats, Series


@dataclass(frozen=True, slots=True)
class Gap:
    """The longest time, s, for which messages of a topic were published and none recorded; which `key`, and `begin`."""

    length: float = 0.0
    key: Key | None = None
    begin: int = 0  # Unix ns


def longest_gap(trace: Trace) -> Gap:
    """Return the longest gap in any topic with periodic messages."""
    periodic = (key for key in trace.series if ROWS[key.kind].delivery is not Delivery.EVENT)
    return max((_longest(key, trace.series[key]) for key in periodic), key=lambda gap: gap.length, default=Gap())


def control_rate(trace: Trace, number: int, spans: list[Span]) -> float | None:
    """Return the share of the steps due within `spans` that the pilot of drone `number` made, None without a span.

    Commands are counted by their sequence numbers: those that only the recorder missed were made.
    """
    total = sum(span.length for span in spans)
    if not total:
        return None
    rate, commands = trace.swarm.control.rate_hz, trace.of("command", number)
    if not len(commands):
        return 0.0
    published, made = _made(commands, rate)
    edges = np.array([[span.begin, span.end] for span in spans], np.int64)
    inside = np.interp((edges - published[0]) / BILLION, (published - published[0]) / BILLION, made)
    return float(np.sum(inside[:, 1] - inside[:, 0]) / (total * rate))


def where(trace: Trace, gap: Gap) -> str:
    """Return in which topic a gap is, and when, as text."""
    topic = f"/{trace.plan.text(gap.key)}" if gap.key is not None else "no topic"
    return f"in {topic}, {(gap.begin - trace.begin) / BILLION:.1f} s after its begin"


def _longest(key: Key, series: Series) -> Gap:
    missed = np.diff(series.sequences) > 1
    lengths = np.where(missed, np.diff(series.published), 0)
    if not len(lengths):
        return Gap()
    at = int(np.argmax(lengths))
    return Gap(float(lengths[at]) / BILLION, key, int(series.published[at]))


def _made(commands: Series, rate: int) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Floats]:
    """Return when commands were published, and how many had been by then; a gap counts for no more than fit into it."""
    order = np.argsort(commands.published, kind="stable")
    published = commands.published[order]
    fitting = np.rint(np.diff(published) / BILLION * rate)
    counted = np.clip(np.diff(commands.sequences[order]), 1, np.maximum(fitting, 1))
    return published, np.concatenate([[0.0], np.cumsum(counted)])
