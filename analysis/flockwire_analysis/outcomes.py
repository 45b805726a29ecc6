"""The outcome of each drone: lost, on the ground in the formation, landed at its place."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import MOTORS_OFF

from flockwire_analysis.observed import Shown
from flockwire_analysis.phases import at
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Series
from flockwire_analysis.tracking import in_formation, places

SILENCE = 2 * SECOND  # ns before the flight's end at which telemetry or a pilot's status may end
DOWN = (FlightState.GROUNDED, FlightState.STOPPED, FlightState.HELD)


class LandingFigures(NamedTuple):
    """The landings: drones that are `not_down` (a sentence each), the largest landing distance, m, and its drone.

    A landing distance is the horizontal distance between begin and end of a drone's landing.
    """

    not_down: tuple[str, ...] = ()
    distance: float | None = None
    drone: str = ""


def lost(trace: Trace) -> tuple[str, ...]:
    """Return a sentence for each drone whose messages ended, or whose motors stopped without an order.

    An end after all were down is ignored: containers and services end one after another.
    """
    ends = [series.logged[-1] for i in trace.flying for _, series in _reports(trace, i) if len(series)]
    end = max(ends, default=trace.end)
    down = max((_last_aloft(trace, i) for i in trace.flying), default=0)
    return tuple(sentence for i in trace.flying for sentence in _losses(trace, i, int(end), down))


def grounded(trace: Trace) -> tuple[str, ...]:
    """Return a sentence for each drone that was on the ground within a formation phase, whatever its pilot reported."""
    found = []
    for i in trace.flying:
        telemetry = trace.of("telemetry", i)
        down = (telemetry.values[:, 0] == FlightState.GROUNDED) & in_formation(trace, telemetry.stamps)
        if down.any():
            found.append(f"{uav(i)} from {at(trace, int(telemetry.stamps[down][0]))}")
    return tuple(found)


def landing(trace: Trace) -> LandingFigures:
    """Return the landings; after an emergency stop they are not judged."""
    up = tuple(sentence for i in trace.flying for sentence in _up(trace, i))
    if len(up) > 1 and "land" not in [mission.verb for mission in trace.missions]:
        up = (f"the recording ends without an order to land, {len(up)} drones in the air",)
    up += tuple(f"no telemetry of {uav(i)} was recorded" for i in trace.flying if not len(trace.of("telemetry", i)))
    distances = {uav(i): d for i in trace.flying if (d := _landing_distance(trace, i)) is not None}
    farthest = max(distances, key=distances.__getitem__, default="")
    return LandingFigures(up, distances.get(farthest), farthest)


def _reports(trace: Trace, number: int) -> tuple[tuple[str, Series], ...]:
    pilot = trace.plan.pilot[number]
    return (
        (f"telemetry of {uav(number)}", trace.of("telemetry", number)),
        (f"status of {pilot}", trace.series.get(Key("status", pilot)) or trace.of("status", number)),
    )


def _last_aloft(trace: Trace, number: int) -> int:
    """Return when telemetry last reported a drone off the ground, Unix ns."""
    telemetry = trace.of("telemetry", number)
    airborne = telemetry.logged[~np.isin(telemetry.values[:, 0], DOWN)]
    return int(airborne[-1]) if len(airborne) else 0


def _losses(trace: Trace, number: int, end: int, down: int) -> Iterator[str]:
    for name, series in _reports(trace, number):
        if not len(series):
            yield f"no {name} was recorded"
        elif series.logged[-1] < end - SILENCE and series.logged[-1] <= down:
            before = (end - int(series.logged[-1])) / SECOND
            yield f"the {name} ends {before:.1f} s before the flight"
    telemetry = trace.of("telemetry", number)
    stopped = telemetry.stamps[telemetry.values[:, 0] == FlightState.STOPPED]
    if len(stopped) and not any(stop.stamp <= stopped[0] + SECOND for stop in trace.stops):
        own = f": {uav(number)} "  # behind the process that told it
        why = "".join(f": it {told.partition(own)[2]}" for told in trace.reasons[MOTORS_OFF] if own in told)
        yield f"the motors of {uav(number)} stopped without an order at {at(trace, int(stopped[0]))}{why}"


def _up(trace: Trace, number: int) -> Iterator[str]:
    telemetry = trace.of("telemetry", number)
    if len(telemetry) and telemetry.values[-1, 0] not in DOWN:
        yield f"{uav(number)} was not on the ground at the end, but {telemetry.values[-1, 2]:.2f} m above it"


def _landing_distance(trace: Trace, number: int) -> float | None:
    positions, begin = trace.positions(number), _landing_began(trace, number)
    if begin is None or not len(positions):
        return None
    (x, y, _), end = places(trace, number, np.array([begin]))[0], positions.values[-1]
    return float(np.hypot(end[0] - x, end[1] - y)) if np.isfinite(x) else None


def _landing_began(trace: Trace, number: int) -> int | None:
    """Return when a drone's last landing began: at its order, or earlier by its pilot."""
    orders = [mission.stamp for mission in trace.missions if mission.verb == "land"]
    changes = pairwise([Shown(0, ""), *trace.shown.get(trace.plan.pilot[number], ())])
    own = [one.stamp for before, one in changes if one.phase == Phase.LANDING != before.phase]
    return min([*orders[-1:], *own[-1:]], default=None)
