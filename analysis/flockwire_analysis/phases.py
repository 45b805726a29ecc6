"""When a flight did what: the span in the air, a phase for each formation ordered, and the formation in force."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

import numpy as np
from flockwire.control.formation import Formation
from flockwire.domain.time import SECOND
from flockwire.pilot.orders import flown_formation, is_known
from flockwire.wire.messages import Mission

from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Booleans, Floats, Integers

TAIL = 0.3  # share of the formation phase at its end by which tracking is judged


@dataclass(frozen=True, slots=True)
class Span:
    """From `begin` to `end`, Unix time in ns."""

    begin: int
    end: int

    @property
    def length(self) -> float:
        """Length in s."""
        return (self.end - self.begin) / SECOND

    def tail(self) -> Span:
        """Return the last part, by which tracking is judged."""
        return Span(self.end - int(TAIL * (self.end - self.begin)), self.end)

    def instants(self, count: int) -> Integers:
        """Return `count` instants from begin to end, Unix ns."""
        return np.linspace(self.begin, self.end, count).astype(np.int64)

    def holds(self, stamps: Integers) -> Booleans:
        """Return which stamps (Unix ns) lie within."""
        return np.asarray((stamps >= self.begin) & (stamps <= self.end))


@dataclass(frozen=True, slots=True)
class FormationPhase:
    """What one order to start amounts to: its `formation` (the name in the order) and the `span` in which it held."""

    formation: str
    span: Span


def airborne(trace: Trace) -> Span:
    """Return the span of the flights: from the first order (else the trace's begin) to the trace's end, or to a stop.

    After an emergency stop drones fall, which is no measure of how they flew.
    """
    begin = min((mission.stamp for mission in trace.missions if mission.verb != "land"), default=trace.begin)
    return Span(begin, _end(trace, begin))


def formation_phases(trace: Trace) -> tuple[FormationPhase, ...]:
    """Return a phase for each order to start, from the formation's time 0 (or the order, where that is later).

    It ends with the next order of any kind, with a stop, or with the trace. An order without a time left has none.
    """
    found = []
    for mission, following in zip_longest(trace.missions, trace.missions[1:]):
        begin = max(mission.start, mission.stamp)
        end = _end(trace, mission.stamp)
        if following is not None:
            end = min(end, following.stamp)
        if mission.in_formation and begin < end:
            found.append(FormationPhase(mission.formation, Span(begin, end)))
    return tuple(found)


def _end(trace: Trace, begin: int) -> int:
    """Return when what began at `begin` ends if no order ends it."""
    return min([trace.end, *(stop.stamp for stop in trace.stops if stop.stamp > begin)])


def offsets(trace: Trace, number: int, stamps: Integers) -> Floats:
    """Return follower `number`'s offset h_i(t - start), m, one row for each of `stamps` (Unix ns), NaN before a start.

    In force is the newest start; one whose time 0 lies in the past is in force from when it was published.
    """
    index = trace.swarm.followers.index(number)
    result = np.full((len(stamps), 3), np.nan)
    starts = [mission for mission in trace.missions if mission.in_formation]
    for place, mission in enumerate(starts):
        formation = formation_of(trace, mission)
        if formation is None:
            continue
        since = max(mission.start, mission.stamp) if place else mission.start
        rows = stamps >= since
        times = (stamps[rows] - mission.start) / SECOND
        result[rows] = [formation.offset(index, float(t)) for t in times] or np.empty((0, 3))
    return result


def formation_of(trace: Trace, mission: Mission) -> Formation | None:
    """Return the formation that an order has flown, None when the swarm does not know it."""
    named = {mission.formation} if mission.change is None else {mission.formation, mission.change.before}
    formations = {name: trace.swarm.build_formation(name) for name in named.intersection(trace.swarm.formation_names)}
    return flown_formation(formations, mission) if is_known(formations, mission) else None
