"""The margins of a flight: how far each property was from being violated, by the arrays of the flight.

Each property is "always" of a signal that must not be negative (signal temporal logic; Donze and Maler, 2010). Its
margin is the smallest value of that signal, as a share of the bound: 1 or more far from the bound, 0 at it, negative
beyond it. "Always, if a then b within T" is "always (T - u)" with the age u of what is owed: the time since a without
b.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import isfinite

import numpy as np
from flockwire.control.graph import LEADER
from flockwire.domain.airframe import FlightState
from flockwire.domain.time import SECOND
from flockwire.process.driving import FROZEN
from flockwire.swarm.model import uav
from flockwire.wire.phase import Phase
from flockwire_analysis.separation import surface_distance
from flockwire_analysis.series import Booleans, Floats

from flockwire_sim.search.record import Flown, Reports


@dataclass(frozen=True, slots=True)
class Bounds:
    """What no flight may exceed, whatever is faulty."""

    collision: float = 0.2  # m between two centres, in the air
    obstacle: float = 0.1  # m from a centre to the surface of an obstacle, in the air
    in_the_air: float = 0.15  # m
    down: float = 0.05  # m, height at the end
    hard: float = 0.3  # m/s above `limits.vertical_speed` from which on a touch-down is too fast
    fence: float = 0.5  # m beyond `limits.fence.margin`
    silence: float = 5.0  # s to be on the ground after an input is lost, besides that of the descent
    landing: float = 10.0  # s to be on the ground after a pilot began to land, besides that of the descent
    stop: float = 1.0  # s until the motors are off
    rung: float = 0.3  # s after its age in `limits.staleness` until a rung is reached
    obeyed: float = 3.0  # s in which an order has reached whoever can be reached
    longest: float = 75.0  # s of a flight: the operator waits up to 30 s for a stage


BOUNDS = Bounds()
PAUSE = 0.1  # s without true positions: the world was frozen, or restarted
SILENT = 0.35  # s without a process's reports, ten a second, that show it frozen or dead


@dataclass(frozen=True, slots=True)
class Margin:
    """The smallest value of a property's signal, as a share of its bound; when it was, whose it was, and in words."""

    value: float
    at: float  # s after the order to take off
    who: str
    what: str

    @property
    def violated(self) -> bool:
        """Whether the property does not hold."""
        return self.value < 0.0


def always(times: Floats, signal: Floats) -> tuple[float, float]:
    """Return the smallest value of `signal` and its time; infinite without samples."""
    if not len(signal):
        return np.inf, 0.0
    place = int(np.argmin(signal))
    return float(signal[place]), float(times[place])


def owed(times: Floats, pending: Booleans) -> Floats:
    """Return for how long without a pause `pending` has been true, s; 0 where it is not."""
    since = np.where(pending, -np.inf, times)
    began = np.where(pending & ~np.roll(pending, 1), times, -np.inf)
    if len(pending) and pending[0]:
        began[0] = times[0]
    return np.where(pending, times - np.maximum.accumulate(np.maximum(since, began)), 0.0)


def age(times: Floats, events: Floats) -> Floats:
    """Return the time since the last of `events` (ascending) at each of `times`, s; infinite before the first."""
    if not len(events):
        return np.full(len(times), np.inf)
    place = np.searchsorted(events, times, "right")
    return np.where(place > 0, times - events[np.maximum(place - 1, 0)], np.inf)


def margins(flown: Flown, bounds: Bounds = BOUNDS) -> dict[str, Margin]:
    """Return the smallest margin of each property that the flight tells of, by the property's name."""
    found: dict[str, Margin] = {}
    for name, margin in _all(flown, bounds):
        if not isfinite(margin.value):  # the flight does not tell of it
            continue
        if name not in found or margin.value < found[name].value:
            found[name] = margin
    return found


def _all(flown: Flown, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    if flown.took_off:
        yield from _distances(flown, bounds)
        for owner in flown.times:
            yield from _of_drone(flown, owner, bounds)
            yield from _rungs(flown, owner, bounds)
    yield from _formed(flown)
    for what in flown.deviations[:1]:
        yield "protocol", Margin(-1.0, 0.0, what.split()[0], what)
    for since, owner in flown.refused:
        yield (
            "order",
            Margin(1.0 - since / bounds.obeyed, since, owner, f"takes off {since:.2f} s after a landing was ordered"),
        )
    yield from _end(flown, bounds)


def _formed(flown: Flown) -> Iterator[tuple[str, Margin]]:
    """Yield the margins of the formation, where it is owed: its time, and its errors at the end."""
    for owed_for, bound in flown.formed:
        yield "formation", Margin(1.0 - owed_for / bound, owed_for, "", f"not in formation for {owed_for:.1f} s")
    for owner, (at, error) in flown.tails.items():
        tail = flown.swarm.checks.formation_tail
        yield "tail", Margin(1.0 - error / tail, at, owner, f"{owner} {error:.3f} m from its place")


def _end(flown: Flown, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    took, begin = flown.seconds, max((float(times[-1]) for times in flown.times.values()), default=0.0)
    yield "over", Margin(1.0 - took / bounds.longest, begin, "", f"took {took:.0f} s")
    if not flown.world_ended:
        for owner, places in flown.places.items():
            high = float(places[-1, 2])
            yield "down", Margin(1.0 - max(high, 0.0) / bounds.down, begin, owner, f"ended at {high:.2f} m")


def falling(flown: Flown, owner: str, times: Floats) -> Booleans:
    """Return at which of `times` a drone falls, which no pilot can change: its motors failed, or were stopped."""
    return (times >= flown.stopped) | (times >= flown.fails.get(owner, np.inf))


def placed(flown: Flown, owner: str, times: Floats) -> Floats:
    """Return the newest true positions of a drone at `times`, m."""
    place = np.searchsorted(flown.times[owner], times, "right") - 1
    return flown.places[owner][np.maximum(place, 0)]


def pair_distances(
    flown: Flown, bounds: Bounds = BOUNDS, falls: bool = False
) -> Iterator[tuple[str, str, Floats, Floats]]:
    """Yield each pair, times at which both are in the air and neither falls, and their distances then, m.

    `falls`: the times at which one of both falls instead.
    """
    times = np.unique(np.concatenate(list(flown.times.values())))
    times = times[times >= 0.0]
    places = {owner: placed(flown, owner, times) for owner in flown.times}
    fall = {owner: falling(flown, owner, times) for owner in flown.times}
    for one, other in combinations(flown.times, 2):
        high = (places[one][:, 2] > bounds.in_the_air) & (places[other][:, 2] > bounds.in_the_air)
        wanted = high & (fall[one] ^ fall[other] if falls else ~(fall[one] | fall[other]))
        yield one, other, times[wanted], np.linalg.norm(places[one][wanted] - places[other][wanted], axis=1)


def closest(flown: Flown, bounds: Bounds = BOUNDS, falls: bool = False) -> float:
    """Return the smallest distance of two drones in the air, m; `falls`: of which one falls."""
    return min((always(times, gaps)[0] for *_, times, gaps in pair_distances(flown, bounds, falls)), default=np.inf)


def _distances(flown: Flown, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, two drones in the air are not closer than a collision."""
    for one, other, times, gaps in pair_distances(flown, bounds):
        gap, at = always(times, gaps)
        yield "distance", Margin(gap / bounds.collision - 1.0, at, one, f"{one} and {other} {gap:.3f} m apart")


def _of_drone(flown: Flown, owner: str, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    times = flown.times[owner]
    begun = times >= 0.0
    times, places = times[begun], flown.places[owner][begun]
    flies = (places[:, 2] > bounds.in_the_air) & ~falling(flown, owner, times)
    limits, states = flown.swarm.limits, flown.states.get(owner)
    # A driver that is frozen or dead owes nothing.
    steered = flies if states is None else flies & (age(times, states.times) < SILENT)
    for obstacle in flown.swarm.obstacles:
        gap, at = always(times[steered], surface_distance(places[steered], obstacle))
        yield "clearance", Margin(gap / bounds.obstacle - 1.0, at, owner, f"{owner} {gap:.3f} m from an obstacle")
    room, reach = limits.fence.room(), limits.fence.margin + bounds.fence
    beyond = np.array([room.outside((x, y, z)) for x, y, z in places[steered].tolist()])
    inside, at = always(times[steered], -beyond)
    yield "fence", Margin(1.0 + inside / reach, at, owner, f"{owner} {-inside:.2f} m outside the fence")
    seen = places * (0.0, 0.0, 1.0) if flown.visited else places
    yield from _contacts(owner, times, seen, falling(flown, owner, times), limits.vertical_speed + bounds.hard)
    yield from _silences(flown, owner, times, steered, bounds)
    yield from _stops(flown, owner, bounds)


def first_outside(flown: Flown) -> float | None:
    """Return when a drone off the ground was first outside the fence, s; None if none was."""
    room, found = flown.swarm.limits.fence.room(), []
    for owner, times in flown.times.items():
        off = (times >= 0.0) & (flown.places[owner][:, 2] > 0.0) if flown.took_off else np.zeros(len(times), np.bool_)
        places = flown.places[owner][off].tolist()
        found += [t for t, (x, y, z) in zip(times[off].tolist(), places, strict=True) if room.outside((x, y, z)) > 0.0][
            :1
        ]
    return min(found, default=None)


def _contacts(
    owner: str, times: Floats, places: Floats, falls: Booleans, fastest: float
) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who touches the ground is not too fast in the frame before."""
    if len(times) < 3:
        return
    dt = np.diff(times)
    speeds = np.where(dt > PAUSE, 0.0, np.linalg.norm(np.diff(places, axis=0), axis=1) / np.maximum(dt, 1e-9))
    touches = (places[2:, 2] <= 0.0) & (places[1:-1, 2] > 0.0) & (dt[1:] <= PAUSE) & ~falls[2:]
    speed, at = always(times[2:][touches], -speeds[:-1][touches])
    yield "contact", Margin(1.0 + speed / fastest, at, owner, f"{owner} touched down at {-speed:.2f} m/s")


def _silences(flown: Flown, owner: str, times: Floats, flies: Booleans, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who lost its pose, or its pilot's commands, for as long as the ladder has it, is down within T.

    T includes the descent from the top of the fence.
    """
    limits, stale = flown.swarm.limits, flown.swarm.limits.staleness
    bound = bounds.silence + limits.fence.high[2] / limits.vertical_speed
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


def _stops(flown: Flown, owner: str, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, after a stop the motors are off within T. A driver that is frozen owes nothing."""
    states = flown.states.get(owner)
    if states is None or not np.isfinite(flown.stopped):
        return
    off = states.stopped | np.array([s in (FlightState.STOPPED, FlightState.GROUNDED) for s in states.states])
    pending = (states.times >= flown.stopped) & ~off
    pause = np.diff(states.times, prepend=states.times[:1]) > SILENT
    late, at = always(states.times, -owed(states.times, pending & ~pause))
    yield "stop", Margin(1.0 + late / bounds.stop, at, owner, f"{owner} flies {-late:.2f} s after a stop")


def _rungs(flown: Flown, owner: str, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, no pilot and no driver does what an age in `limits.staleness` forbids, but for `bounds.rung`."""
    stale = flown.swarm.limits.staleness
    reports, states = flown.reports.get(owner), flown.states.get(owner)
    if reports is not None:
        phases = np.array(reports.phases)
        awake = (np.diff(reports.times, prepend=-np.inf) < SILENT) & (reports.times > 0.0)  # not just thawed
        awake &= ~falling(flown, owner, reports.times)
        flying = np.isin(phases, (Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION))
        forming = phases == Phase.FORMATION
        rested = np.isin(phases, (Phase.GROUNDED, Phase.READY))
        flying[1:] &= ~rested[:-1]  # a pilot whose drone flies all the same decides in its next step
        for name, ages, limit, wrong in (
            ("own pose: hold", reports.pose_ages, stale.pose_zero, forming),
            ("own pose: land", reports.pose_ages, stale.pose_land, flying),
            ("nearby: hold", reports.nearby_ages, stale.nearby_hold, forming),
            ("telemetry: land", reports.telemetry_ages, stale.telemetry_land, flying),
        ):
            yield from _rung(owner, name, reports.times, ages, limit + bounds.rung, awake & wrong)
        low = (reports.batteries >= 0.0) & (reports.batteries < flown.swarm.limits.battery_land) & awake & flying
        yield from _rung(owner, "battery: land", reports.times, owed(reports.times, low), bounds.rung, flying)
        yield from _landing(flown, owner, reports, bounds)
        leads = flown.poses.get(uav(LEADER))
        if leads is not None and owner != uav(LEADER):
            silent = age(reports.times, leads)  # what its neighbours pass on is not younger
            for name, limit, wrong in (
                ("leader estimate: hold", stale.estimates_hold, forming),
                ("leader estimate: land", stale.estimates_land, flying),
            ):
                yield from _rung(owner, name, reports.times, silent, limit + bounds.rung, awake & wrong)
    if states is not None:
        flying = np.array([state is FlightState.FLYING for state in states.states], np.bool_)
        elapsed = np.diff(states.times, prepend=-np.inf)
        jumped = np.diff(states.command_ages, prepend=0.0) > elapsed + FROZEN / SECOND  # its clock, not the silence
        begins = (elapsed > SILENT) | jumped
        ages = np.minimum(states.command_ages, age(states.times, states.times[begins]))  # a pause restarts its limit
        free = flying & ~falling(flown, owner, states.times)
        yield from _rung(owner, "driver: land", states.times, ages, stale.command_land + bounds.rung, free)


def _landing(flown: Flown, owner: str, reports: Reports, bounds: Bounds) -> Iterator[tuple[str, Margin]]:
    """Yield: always, who lands is on the ground within T. It may wait for its pose, and for a free place, once each."""
    times, limits = reports.times, flown.swarm.limits
    bound = bounds.landing + limits.fence.high[2] / limits.vertical_speed
    lands = np.array([phase == Phase.LANDING for phase in reports.phases], np.bool_)
    lands &= (placed(flown, owner, times)[:, 2] > bounds.in_the_air) & ~falling(flown, owner, times)
    if (states := flown.states.get(owner)) is not None:
        lands &= age(times, states.times) < SILENT  # a driver that is frozen or dead owes nothing
    late, at = always(times[lands], -owed(times, lands)[lands])
    yield "landing", Margin(1.0 + late / bound, at, owner, f"{owner} lands for {-late:.1f} s")


def _rung(
    owner: str, name: str, times: Floats, ages: Floats, limit: float, wrong: Booleans
) -> Iterator[tuple[str, Margin]]:
    least, at = always(times[wrong], -ages[wrong])
    yield "rung", Margin(1.0 + least / limit, at, owner, f"{owner} not at {name} after {-least:.2f} s")
