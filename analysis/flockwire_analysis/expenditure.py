"""What a law cost in a flight, per follower: paths, messages, their bytes, and the effort of commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from flockwire_core.domain.time import SECOND

from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats, Integers, Series
from flockwire_analysis.tracking import in_formation, norms

EXCHANGED = frozenset({"estimate", "law"})  # kinds of keys by which a law speaks to its neighbours


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
    """Return the figures of COSTS for a flight, None if unknown.

    The path is the mean length of a follower's, the effort the mean integral of |u|^2 of commanded velocities u; both
    in the formation phases.
    """
    exchanged = [series for key, series in trace.series.items() if key.kind in EXCHANGED]
    share = SECOND / ((trace.end - trace.begin) * len(trace.swarm.followers))
    return {
        "path_m": _mean(trace, trace.positions, lambda _, points: np.sum(norms(np.diff(points, axis=0)))),
        "messages_per_s": sum(len(series) for series in exchanged) * share,
        "bytes_per_s": sum(series.size for series in exchanged) * share,
        "effort_m2_s": _mean(
            trace,
            lambda i: trace.of("command", i),
            lambda stamps, u: np.sum(np.sum(u[:-1] ** 2, axis=1) * np.diff(stamps)) / SECOND,
        ),
    }


def _mean(trace: Trace, of: Callable[[int], Series], measure: Callable[[Integers, Floats], np.float64]) -> float | None:
    """Return the mean over all followers of a `measure` of the formation phases, by stamps and three columns.

    None without a follower, or if one of them has fewer than two samples.
    """
    found = []
    for series in map(of, trace.followers):
        within = in_formation(trace, series.stamps)
        if np.sum(within) < 2:
            return None
        found.append(measure(series.stamps[within], series.values[within, :3]))
    return float(np.mean(found)) if found else None
