"""The margins of a flight: of each property the smallest, whose and when it was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import isfinite

import numpy as np
from flockwire_analysis.separation import surface_distance
from flockwire_analysis.series import Booleans, Floats

from flockwire_lab.search.deadlines import deadlines
from flockwire_lab.search.flown import Flown
from flockwire_lab.search.margin import BOUNDS, PAUSE, Bounds, Margin, always, awake, falling, placed


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
    limits, driven = flown.swarm.limits, awake(flown, owner, times)
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
    yield from _contacts(owner, times, seen, falling(flown, owner, times), fastest, flown.jumps)
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
