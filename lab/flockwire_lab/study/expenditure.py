"""What a law costs: its messages and their bytes, paths and effort, beside the figures of a study."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_analysis.expenditure import effort, path_length
from flockwire_analysis.recorded import Trace
from flockwire_core.domain.time import SECOND

EXCHANGED = frozenset({"estimate", "law", "bids"})  # kinds of keys by which a law speaks to its neighbours


class Cost(NamedTuple):
    """A figure of a law: its key in a result, its heading, its unit."""

    key: str
    heading: str
    unit: str


COSTS = (
    Cost("path_m", "path", "m"),
    Cost("messages_per_s", "messages", "1/s"),
    Cost("bytes_per_s", "data", "B/s"),
    Cost("effort_m2_s", "effort", "m²/s"),
)


def costs(trace: Trace) -> dict[str, float | None]:
    """Return the figures of COSTS for a flight, per follower."""
    kinds = [key for key in trace.series if key.kind in EXCHANGED]
    share = SECOND / ((trace.end - trace.begin) * len(trace.swarm.followers))
    return {
        "path_m": path_length(trace),
        "messages_per_s": sum(len(trace.series[key]) for key in kinds) * share,
        "bytes_per_s": sum(trace.sizes[key] for key in kinds) * share,
        "effort_m2_s": effort(trace),
    }
