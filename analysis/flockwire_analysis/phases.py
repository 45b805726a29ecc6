"""The times of a flight: its events, the span in the air, a phase for each ordered formation, the one in force."""

from __future__ import annotations

import json
from itertools import pairwise, zip_longest
from typing import NamedTuple

import numpy as np
from flockwire_core.control.formation import Formation
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.pilot.orders import flown_place, is_known
from flockwire_core.swarm.model import uav

from flockwire_analysis import FAULTS
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Booleans, Floats, Integers

TAIL = 0.3  # share of the formation phase, at its end, that judges tracking


class Span(NamedTuple):
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


class FormationPhase(NamedTuple):
    """The phase of one start order, and the `span` in which it was in force."""

    order: Mission
    span: Span


def airborne(trace: Trace) -> Span:
    """Return the span of the flights in the trace: from the first order (else its start) to its end, or to a stop.

    After an emergency stop drones fall, which is not judged.
    """
    begin = min((mission.stamp for mission in trace.missions if mission.verb != "land"), default=trace.begin)
    begin = max(begin, trace.begin)
    return Span(begin, _end(trace, begin))


def origin(trace: Trace) -> int:
    """Return the flight's time 0, Unix ns: that of its first formation; the trace's begin if none was flown."""
    return next((phase.span.begin for phase in formation_phases(trace)), trace.begin)


def at(trace: Trace, stamp: int) -> str:
    """Return `stamp` (Unix ns) as the flight's time, in words: negative before its first formation."""
    return f"t = {(stamp - origin(trace)) / SECOND:.1f} s"


def formation_phases(trace: Trace) -> tuple[FormationPhase, ...]:
    """Return a phase for each start order, from the formation's time 0 (or the order, if later).

    It ends with the next order of any kind, with a stop, or with the trace. An order without remaining time has no
    phase.
    """
    found = []
    for mission, following in zip_longest(trace.missions, trace.missions[1:]):
        begin = max(mission.start, mission.stamp, trace.begin)
        end = _end(trace, mission.stamp)
        if following is not None:
            end = min(end, following.stamp)
        if mission.in_formation and begin < end:
            found.append(FormationPhase(mission, Span(begin, end)))
    return tuple(found)


def _end(trace: Trace, begin: int) -> int:
    """Return the end of a phase that began at `begin`, if no order ends it."""
    return min([trace.end, *(stop.stamp for stop in trace.stops if stop.stamp > begin)])


def offsets(trace: Trace, number: int, stamps: Integers) -> Floats:
    """Return follower `number`'s offset h_i(t - start), m, one row for each of `stamps` (Unix ns), NaN before a start.

    The newest start is in force; one with a past time 0 is in force from its publication. NaN while a follower holds no
    place of an auction.
    """
    forever = 1 << 62  # ns
    result = np.full((len(stamps), 3), np.nan)
    starts = [mission for mission in trace.missions if mission.in_formation]
    for place, mission in enumerate(starts):
        if (formations := formations_of(trace, mission)) is None:
            continue
        since = max(mission.start, mission.stamp) if place else mission.start
        held = _held(trace, number, mission, since)
        for (begin, index), (end, _) in pairwise([*held, (forever, None)]):
            rows = (stamps >= begin) & (stamps < end)
            if index is None:
                result[rows] = np.nan
                continue
            won = index if mission.formation in trace.swarm.auctioned else None
            rank = trace.swarm.followers.index(number)
            formation, which = flown_place(formations, mission, rank, won)
            times = (stamps[rows] - mission.start) / SECOND
            result[rows] = [formation.offset(which, float(t)) for t in times] or np.empty((0, 3))
    return result


def shared_places(trace: Trace, least: float) -> tuple[str, ...]:
    """Return a sentence for each two followers that held one place at the end of a phase of `least` s or more."""
    found = []
    for mission, span in formation_phases(trace):
        if mission.formation not in trace.swarm.auctioned or span.length < least:
            continue
        owners: dict[int | None, int] = {}
        for number in trace.followers:
            place = [place for at, place in _held(trace, number, mission, span.begin) if at <= span.end][-1]
            other = owners.setdefault(place, number)
            if place is not None and other != number:
                found.append(f"{uav(other)} and {uav(number)} both hold place {place}")
    return tuple(found)


def _held(trace: Trace, number: int, mission: Mission, since: int) -> list[tuple[int, int | None]]:
    """Return from when on (Unix ns), `since` at first, follower `number` had which place (rank) by an order.

    Without an auction that is its own rank.
    """
    if mission.formation not in trace.swarm.auctioned:
        return [(since, trace.swarm.followers.index(number))]
    told = [one for one in trace.held.get(number, ()) if one.order == mission.version]
    return [(since, None), *((max(since, one.stamp), one.place) for one in told)]


def formations_of(trace: Trace, mission: Mission) -> dict[str, Formation] | None:
    """Return the formations of an order by name, None if the swarm does not have them."""
    named = {mission.formation} if mission.change is None else {mission.formation, mission.change.before}
    formations = {name: trace.swarm.build_formation(name) for name in named.intersection(trace.swarm.formation_names)}
    return formations if is_known(formations, mission) else None


class Event(NamedTuple):
    """An event at `stamp` (Unix ns), with a short name; `kind` is "order", "stop" or "fault"."""

    stamp: int
    text: str
    kind: str = "order"


def events(trace: Trace) -> tuple[Event, ...]:
    """Return the events to mark in the figures of a flight."""
    took_off = next((mission.stamp for mission in trace.missions if mission.verb == "takeoff"), trace.begin)
    injected = json.loads(trace.metadata.get(FAULTS, "[]"))
    faults = [Event(took_off + nanoseconds(at), text, "fault") for at, text in injected]
    return tuple(sorted((*map(_order, trace.missions), *_stops(trace), *faults)))


def _order(mission: Mission) -> Event:
    """Return the event of an order; a start counts from the formation's time 0."""
    when = max(mission.start, mission.stamp) if mission.in_formation else mission.stamp
    return Event(when, f"{mission.verb} {mission.formation}".strip())


def _stops(trace: Trace) -> list[Event]:
    repeats = 3 * SECOND  # ns in which a stop counts as a repetition
    found: list[Event] = []
    for stop in trace.stops:
        if not found or stop.stamp - found[-1].stamp > repeats:
            found.append(Event(stop.stamp, "STOP", "stop"))
    return found
