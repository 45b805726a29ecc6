"""When a flight did what: the span in the air, the formation phase, and the formation in force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flockwire.control.formation import Formation
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Mission

from flockwire_recorder.reading import Floats, Integers, Trace

TAIL = 0.3  # share of the formation phase at its end by which tracking is judged


@dataclass(frozen=True, slots=True)
class Span:
    """From `begin` to `end`, Unix time in ns."""

    begin: int
    end: int

    @property
    def length(self) -> float:
        """Length in s."""
        return (self.end - self.begin) / BILLION

    def tail(self) -> Span:
        """Return the last part, by which tracking is judged."""
        return Span(self.end - int(TAIL * (self.end - self.begin)), self.end)

    def holds(self, stamps: Integers) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Tell which stamps (Unix ns) lie within."""
        return np.asarray((stamps >= self.begin) & (stamps <= self.end))


def airborne(trace: Trace) -> Span:
    """Return the span from the first take-off (else the trace's begin) to the next landing (else its end)."""
    begin = next((mission.stamp for mission in trace.missions if mission.verb == "takeoff"), trace.begin)
    landings = (mission.stamp for mission in trace.missions if mission.verb == "land" and mission.stamp > begin)
    return Span(begin, min(next(landings, trace.end), trace.end))


def formation_phase(trace: Trace) -> Span | None:
    """Return the span from the formation's time 0 to the next hold or landing (else the trace's end).

    None when no formation was started, or only after the end.
    """
    first = next((mission for mission in trace.missions if mission.verb == "start"), None)
    if first is None:
        return None
    ends = (m.stamp for m in trace.missions if m.verb in ("hold", "land") and m.stamp > first.stamp)
    end = min(next(ends, trace.end), trace.end)
    return Span(first.start, end) if first.start < end else None


def offsets(trace: Trace, number: int, stamps: Integers) -> Floats:
    """Return follower `number`'s offset h_i(t - start), m, one row for each of `stamps` (Unix ns), NaN before a start.

    In force is the newest start; one whose time 0 lies in the past is in force from when it was said.
    """
    index = trace.swarm.followers.index(number)
    result = np.full((len(stamps), 3), np.nan)
    starts = [mission for mission in trace.missions if mission.verb == "start"]
    for place, mission in enumerate(starts):
        formation = formation_of(trace, mission)
        if formation is None:
            continue
        since = max(mission.start, mission.stamp) if place else mission.start
        rows = stamps >= since
        times = (stamps[rows] - mission.start) / BILLION
        result[rows] = [formation.offset(index, float(t)) for t in times] or np.empty((0, 3))
    return result


def formation_of(trace: Trace, mission: Mission) -> Formation | None:
    """Return the formation that a start names, None when the swarm has none of that name."""
    if mission.formation and mission.formation not in trace.swarm.formations:
        return None
    return trace.swarm.build_formation(mission.formation)
