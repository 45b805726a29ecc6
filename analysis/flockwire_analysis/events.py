"""The events of a flight in order of time: orders, stops and injected faults."""

from __future__ import annotations

import json
from typing import NamedTuple

from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds

from flockwire_analysis import FAULTS
from flockwire_analysis.recorded import Trace


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
