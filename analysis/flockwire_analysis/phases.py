"""The times of a flight: the span in the air, a phase for each ordered formation, the formation in force."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

import numpy as np
from flockwire.control.formation import Formation
from flockwire.domain.order import Mission
from flockwire.domain.time import SECOND
from flockwire.pilot.orders import flown_formation, is_known

from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Booleans, Floats, Integers

TAIL = 0.3  # share of the formation phase, at its end, that judges tracking


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
        """Return the last part, which judges tracking."""
        return Span(self.end - int(TAIL * (self.end - self.begin)), self.end)

    def instants(self, count: int) -> Integers:
        """Return `count` instants from begin to end, Unix ns."""
        return np.linspace(self.begin, self.end, count).astype(np.int64)

    def holds(self, stamps: Integers) -> Booleans:
        """Return which stamps (Unix ns) are within."""
        return np.asarray((stamps >= self.begin) & (stamps <= self.end))


@dataclass(frozen=True, slots=True)
class FormationPhase:
    """The phase of one start order: its `formation` (the name in the order) and the `span` in which it was in force."""

    formation: str
    span: Span


def airborne(trace: Trace) -> Span:
    """Return the span of the flights: from the first order (else the trace's start) to the trace's end, or to a stop.

    After an emergency stop drones fall, which is not judged.
    """
    begin = min((mission.stamp for mission in trace.missions if mission.verb != "land"), default=trace.begin)
    return Span(begin, _end(trace, begin))


def formation_phases(trace: Trace) -> tuple[FormationPhase, ...]:
    """Return a phase for each start order, from the formation's time 0 (or the order, if later).

    It ends with the next order of any kind, with a stop, or with the trace. An order without remaining time has no
    phase.
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
    """Return the end of a phase that began at `begin`, if no order ends it."""
    return min([trace.end, *(stop.stamp for stop in trace.stops if stop.stamp > begin)])


def offsets(trace: Trace, number: int, stamps: Integers) -> Floats:
    """Return follower `number`'s offset h_i(t - start), m, one row for each of `stamps` (Unix ns), NaN before a start.

    The newest start is in force; one with a past time 0 is in force from its publication.
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
    """Return the formation of an order, None if the swarm does not have it."""
    named = {mission.formation} if mission.change is None else {mission.formation, mission.change.before}
    formations = {name: trace.swarm.build_formation(name) for name in named.intersection(trace.swarm.formation_names)}
    return flown_formation(formations, mission) if is_known(formations, mission) else None
