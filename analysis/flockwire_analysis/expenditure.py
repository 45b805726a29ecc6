"""What a law cost in a flight, per follower: paths, messages, their bytes, and the effort of commands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flockwire_core.domain.time import SECOND

from flockwire_analysis.recorded import Trace
from flockwire_analysis.tracking import in_formation

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
    """Return the figures of COSTS for a flight."""
    kinds = [key for key in trace.series if key.kind in EXCHANGED]
    share = SECOND / ((trace.end - trace.begin) * len(trace.swarm.followers))
    return {
        "path_m": path_length(trace),
        "messages_per_s": sum(len(trace.series[key]) for key in kinds) * share,
        "bytes_per_s": sum(trace.sizes[key] for key in kinds) * share,
        "effort_m2_s": effort(trace),
    }


def path_length(trace: Trace) -> float | None:
    """Return the length of a follower's path in the formation phases, m, the mean of all; None without one."""
    lengths = []
    for i in trace.followers:
        series = trace.positions(i)
        points = series.values[in_formation(trace, series.stamps), :3]
        lengths.append(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) if len(points) > 1 else None)
    return _mean(lengths)


def effort(trace: Trace) -> float | None:
    """Return the integral of |u|^2 over the formation phases, m^2/s, of commanded velocities u, the mean of all."""
    efforts = []
    for i in trace.followers:
        series = trace.of("command", i)
        within = in_formation(trace, series.stamps)
        stamps, squares = series.stamps[within], (series.values[within, :3] ** 2).sum(axis=1)
        efforts.append(float((squares[:-1] * np.diff(stamps)).sum()) / SECOND if len(stamps) > 1 else None)
    return _mean(efforts)


def _mean(found: list[float | None]) -> float | None:
    known = [one for one in found if one is not None]
    return float(np.mean(known)) if known and len(known) == len(found) else None
