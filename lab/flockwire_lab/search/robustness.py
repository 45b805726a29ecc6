"""The margins of a flight: of each property the smallest, whose and when it was; of what is owed within a time, too."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import isfinite

import numpy as np
from flockwire_analysis.separation import surface_distance
from flockwire_analysis.series import Booleans, Floats
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.process.driving import FROZEN
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.phase import Phase

from flockwire_lab.search.margin import BOUNDS, PAUSE, SILENT, Bounds, Flown, Margin, Reports, States, age, always, owed


def margins(flown: Flown, bounds: Bounds = BOUNDS) -> dict[str, Margin]:
    """Return the smallest margin of each property that the flight tells of, by the property's name."""
    found: dict[str, Margin] = {}
    for name, margin in _all(flown, bounds):
        known = isfinite(margin.value)  # else the flight does not tell of it
        if known and (name not in found or margin.value < found[name].value):
            found[name] = margin
    return found


def _all(flown: Flown, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    if flown.took_off:
        yield from _distances(flown, bounds)
        for owner in flown.times:
            yield from _of_drone(flown, owner, bounds)
    for owed_for, bound in flown.formed:
        yield "formation", Margin(1.0 - owed_for / bound, owed_for, "", f"not in formation for {owed_for:.1f} s")
    for owner, (at, error) in flown.tails.items():
        tail = flown.swarm.checks.formation_tail
        yield "tail", Margin(1.0 - error / tail, at, owner, f"{owner} {error:.3f} m from its place")
    for what in flown.deviations[:1]:
        yield "protocol", Margin(-1.0, 0.0, what.split()[0], what)
    for since, owner in flown.refused:
        what = f"takes off {since:.2f} s after a landing was ordered"
        yield "order", Margin(1.0 - since / bounds.obeyed, since, owner, what)
    yield from _end(flown, bounds)


def _end(flown: Flown, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    took, begin = flown.seconds, max((float(times[-1]) for times in flown.times.values()), default=0.0)
    yield "over", Margin(1.0 - took / bounds.longest, begin, "", f"took {took:.0f} s")
    if not flown.world_ended:
        for owner, places in flown.places.items():
            high = float(places[-1, 2])
            yield "down", Margin(1.0 - max(high, 0.0) / bounds.down, begin, owner, f"ended at {high:.2f} m")


def _distances(flown: Flown, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, two drones in the air, neither of which falls, are not closer than a collision."""
    for one, other, times, gaps, fall in pairs_in_the_air(flown, bounds):
        gap, at = always(times[fall == 0], gaps[fall == 0])
        yield "distance", Margin(gap / bounds.collision - 1.0, at, one, f"{one} and {other} {gap:.3f} m apart")


def pairs_in_the_air(flown: Flown, bounds: Bounds = BOUNDS) -> Iterator[tuple[str, str, Floats, Floats, Floats]]:
    """Yield of each two drones the times at which both are in the air, s, the distances, m, and how many fall then."""
    times = np.unique(np.concatenate(list(flown.times.values())))
    times = times[times >= 0.0]
    places = {owner: flown.placed(owner, times) for owner in flown.times}
    flies = {owner: place[:, 2] > bounds.in_the_air for owner, place in places.items()}
    falls = {owner: flown.falling(owner, times).astype(float) for owner in flown.times}
    for one, other in combinations(flown.times, 2):
        both = flies[one] & flies[other]
        gaps = np.linalg.norm(places[one][both] - places[other][both], axis=1)
        yield one, other, times[both], gaps, (falls[one] + falls[other])[both]


def _of_drone(flown: Flown, owner: str, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    times = flown.times[owner]
    begun = times >= 0.0
    times, places = times[begun], flown.places[owner][begun]
    flies = (places[:, 2] > bounds.in_the_air) & ~flown.falling(owner, times)
    limits, driven = flown.swarm.limits, flown.awake(owner, times)
    steered = flies & driven
    for obstacle in flown.swarm.obstacles:
        gap, at = always(times[steered], surface_distance(places[steered], obstacle))
        yield "clearance", Margin(gap / bounds.obstacle - 1.0, at, owner, f"{owner} {gap:.3f} m from an obstacle")
    room, reach = limits.fence.room(), limits.fence.margin + bounds.fence
    beyond = np.zeros(len(times))
    beyond[flies] = [room.outside((x, y, z)) for x, y, z in places[flies].tolist()]
    owing = steered & ~_spoiled(beyond > 0.0, driven)  # nor to be inside at once, once it is awake again
    inside, at = always(times[owing], -beyond[owing])
    yield "fence", Margin(1.0 + inside / reach, at, owner, f"{owner} {-inside:.2f} m outside the fence")
    seen = places * (0.0, 0.0, 1.0) if flown.visited else places
    fastest = limits.vertical_speed + bounds.hard
    yield from _contacts(owner, times, seen, flown.falling(owner, times), fastest, flown.jumps)
    yield from deadlines(flown, owner, times, steered, bounds)


def _spoiled(outside: Booleans, awake: Booleans) -> Booleans:
    """Return which times outside follow, or precede, times outside that are not `awake`, without a break."""
    runs = np.cumsum(np.diff(outside, prepend=False))
    return outside & np.isin(runs, runs[outside & ~awake])


def _contacts(
    owner: str, times: Floats, places: Floats, falls: Booleans, fastest: float, jumps: Sequence[float]
) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who touches the ground is not too fast in the frame before; nobody knows how fast in a jump."""
    if len(times) < 3:
        return
    dt = np.diff(times)
    unknown = dt > PAUSE
    for jump in jumps:
        unknown |= (times[1:] >= jump) & (times[:-1] <= jump + PAUSE)
    speeds = np.where(unknown, 0.0, np.linalg.norm(np.diff(places, axis=0), axis=1) / np.maximum(dt, 1e-9))
    touches = (places[2:, 2] <= 0.0) & (places[1:-1, 2] > 0.0) & (dt[1:] <= PAUSE) & ~falls[2:]
    speed, at = always(times[2:][touches], -speeds[:-1][touches])
    yield "contact", Margin(1.0 + speed / fastest, at, owner, f"{owner} touched down at {-speed:.2f} m/s")


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
    late, at = always(states.times, -owed(states.times, pending & ~pause & flown.moving(states.times)))
    yield "stop", Margin(1.0 + late / bounds.stop, at, owner, f"{owner} flies {-late:.2f} s after a stop")


def _rungs(flown: Flown, owner: str, reports: Reports, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, no pilot does what an age in `limits.staleness` or its battery forbids, but for `bounds.rung`."""
    limits, times, phases = flown.swarm.limits, reports.times, np.array(reports.phases)
    stale = limits.staleness
    runs = (np.diff(times, prepend=-np.inf) < SILENT) & (times > 0.0)  # and is not just thawed
    runs &= ~flown.falling(owner, times)
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
    begins = (elapsed > SILENT) | jumped | ~flown.moving(states.times)
    ages = np.minimum(states.command_ages, age(states.times, states.times[begins]))
    free = flying & ~flown.falling(owner, states.times)
    limit = flown.swarm.limits.staleness.command_land + bounds.rung
    yield _rung(owner, "driver: land", states.times[free], ages[free], limit)


def _landing(flown: Flown, owner: str, reports: Reports, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who lands is on the ground within T. It may wait for its pose, and for a free place, once each."""
    times, bound = reports.times, bounds.landing + _descent(flown.swarm.limits)
    lands = np.array([phase == Phase.LANDING for phase in reports.phases], np.bool_)
    lands &= (flown.placed(owner, times)[:, 2] > bounds.in_the_air) & ~flown.falling(owner, times)
    lands &= flown.awake(owner, times)
    late, at = always(times[lands], -owed(times, lands)[lands])
    yield "landing", Margin(1.0 + late / bound, at, owner, f"{owner} lands for {-late:.1f} s")


def _rung(owner: str, name: str, times: Floats, ages: Floats, limit: float) -> tuple[str, Margin]:
    least, at = always(times, -ages)
    return "rung", Margin(1.0 + least / limit, at, owner, f"{owner} not at {name} after {-least:.2f} s")
