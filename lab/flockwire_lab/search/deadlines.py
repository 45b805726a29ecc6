"""What is owed within a time: landings without an input, rungs, motors that stop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from flockwire_analysis.series import Booleans, Floats
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.process.driving import FROZEN
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.phase import Phase

from flockwire_lab.search.flown import Flown, Reports, States
from flockwire_lab.search.margin import SILENT, Bounds, Margin, age, always, awake, falling, moving, owed, placed


def deadlines(flown: Flown, owner: str, times: Floats, flies: Booleans, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield the margins of what a drone, its pilot and its driver owe; at `times` it `flies`, its driver awake."""
    yield from _silences(flown, owner, times, flies, bounds)
    if (states := flown.states.get(owner)) is not None:
        yield from _stops(flown, owner, states, bounds)
        yield from _driver_rung(flown, owner, states, bounds)
    if (reports := flown.reports.get(owner)) is not None:
        yield from _rungs(flown, owner, reports, bounds)
        yield from _landing(flown, owner, reports, bounds)


def _descent(limits: Limits) -> float:
    """Return s from the top of the fence to the ground."""
    return limits.fence.high[2] / limits.vertical_speed


def _silences(flown: Flown, owner: str, times: Floats, flies: Booleans, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who lost its pose, or its pilot's commands, for as long as the ladder has it, is down within T.

    T includes the descent from the top of the fence.
    """
    stale, bound = flown.swarm.limits.staleness, bounds.silence + _descent(flown.swarm.limits)
    for name, events, limit in (
        ("pose", flown.poses.get(owner, np.empty(0)), stale.pose_land),
        ("commands", flown.commands.get(owner, np.empty(0)), stale.command_land),
    ):
        silent = age(times, events)
        pending = (silent > limit) & flies
        late = np.where(pending, owed(times, pending), np.minimum(silent - limit, 0.0))
        least, at = always(times[flies], -late[flies])
        what = f"{owner} still flies {-least:.1f} s after it had to land without its {name}"
        yield "silence", Margin(1.0 + least / bound, at, owner, what)


def _stops(flown: Flown, owner: str, states: States, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, after a stop the motors are off within T. A driver that is frozen owes nothing."""
    if not np.isfinite(flown.stopped):
        return
    off = states.stopped | np.array([s in (FlightState.STOPPED, FlightState.GROUNDED) for s in states.states])
    pending = (states.times >= flown.stopped) & ~off
    pause = np.diff(states.times, prepend=states.times[:1]) > SILENT
    late, at = always(states.times, -owed(states.times, pending & ~pause & moving(flown, states.times)))
    yield "stop", Margin(1.0 + late / bounds.stop, at, owner, f"{owner} flies {-late:.2f} s after a stop")


def _rungs(flown: Flown, owner: str, reports: Reports, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, no pilot does what an age in `limits.staleness` or its battery forbids, but for `bounds.rung`."""
    limits, times, phases = flown.swarm.limits, reports.times, np.array(reports.phases)
    stale = limits.staleness
    runs = (np.diff(times, prepend=-np.inf) < SILENT) & (times > 0.0)  # and is not just thawed
    runs &= ~falling(flown, owner, times)
    flying = np.isin(phases, (Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION))
    rested = np.isin(phases, (Phase.GROUNDED, Phase.READY))
    flying[1:] &= ~rested[:-1]  # a pilot whose drone flies all the same decides in its next step
    forming, flying = runs & (phases == Phase.FORMATION), runs & flying
    sole = flown.swarm.sole_leader
    leads = flown.poses.get(uav(sole)) if sole is not None and owner != uav(sole) else None
    # What is passed on is not younger; a process counts from its own beginning.
    silent = np.minimum(age(times, leads), age(times, reports.begun)) if leads is not None else np.zeros(len(times))
    low = flying & (reports.batteries >= 0.0) & (reports.batteries < limits.battery_land)
    for name, ages, limit, wrong in (
        ("own pose: hold", reports.pose_ages, stale.pose_zero, forming),
        ("own pose lost: land", reports.pose_ages, stale.pose_land, flying),
        ("nearby: hold", reports.nearby_ages, stale.nearby_hold, forming),
        ("telemetry: land", reports.telemetry_ages, stale.telemetry_land, flying),
        ("leader estimate: hold", silent, stale.estimates_hold, forming),
        ("leader estimate: land", silent, stale.estimates_land, flying),
        ("battery: land", owed(times, low), 0.0, flying),
    ):
        yield _rung(owner, name, times[wrong], ages[wrong], limit + bounds.rung)


def _driver_rung(flown: Flown, owner: str, states: States, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, a driver lands whose pilot is silent. A pause of its own restarts its limit."""
    flying = np.array([state is FlightState.FLYING for state in states.states], np.bool_)
    elapsed = np.diff(states.times, prepend=-np.inf)
    jumped = np.diff(states.command_ages, prepend=0.0) > elapsed + FROZEN / SECOND  # its clock, not the silence
    begins = (elapsed > SILENT) | jumped | ~moving(flown, states.times)
    ages = np.minimum(states.command_ages, age(states.times, states.times[begins]))
    free = flying & ~falling(flown, owner, states.times)
    limit = flown.swarm.limits.staleness.command_land + bounds.rung
    yield _rung(owner, "driver: land", states.times[free], ages[free], limit)


def _landing(flown: Flown, owner: str, reports: Reports, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who lands is on the ground within T. It may wait for its pose, and for a free place, once each."""
    times, bound = reports.times, bounds.landing + _descent(flown.swarm.limits)
    lands = np.array([phase == Phase.LANDING for phase in reports.phases], np.bool_)
    lands &= (placed(flown, owner, times)[:, 2] > bounds.in_the_air) & ~falling(flown, owner, times)
    lands &= awake(flown, owner, times)
    late, at = always(times[lands], -owed(times, lands)[lands])
    yield "landing", Margin(1.0 + late / bound, at, owner, f"{owner} lands for {-late:.1f} s")


def _rung(owner: str, name: str, times: Floats, ages: Floats, limit: float) -> tuple[str, Margin]:
    least, at = always(times, -ages)
    return "rung", Margin(1.0 + least / limit, at, owner, f"{owner} not at {name} after {-least:.2f} s")
