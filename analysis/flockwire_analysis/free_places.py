"""Whose place is free: the error of a follower counts for its law only where it is.

A place x_0 + h_i is taken while it is within the influence radius of an obstacle, of a moving body, or of a drone that
is off its own place for this reason. With s, the distance that it lies inside that radius, and v, by how much the speed
limit exceeds the speed of the place, the follower may be away from

    pi/2 s / v before    to    pi/2 s / v + 3 s after:

the way out and back, round a body at most, and the time in which a law converges. Nothing of it depends on what the
follower itself does.
"""

from __future__ import annotations

from math import pi

import numpy as np
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import Swarm

from flockwire_analysis.moving_bodies import moving_bodies
from flockwire_analysis.phases import Span, formation_phases
from flockwire_analysis.recorded import Trace
from flockwire_analysis.separation import common_times, nearest_surface
from flockwire_analysis.series import Booleans, Floats, Integers
from flockwire_analysis.tracking import SETTLED_BELOW, Errors, norms, own_places
from flockwire_analysis.tracking import places as positions


def undisturbed(trace: Trace, errors: dict[int, Errors]) -> dict[int, Errors]:
    """Return `errors` without the samples of followers whose places were not free."""
    spans = [phase.span for phase in formation_phases(trace)]
    if not spans or not (trace.swarm.obstacles or trace.movers):
        return errors
    times = common_times(Span(spans[0].begin, spans[-1].end), 20)
    places = {i: own_places(trace, i, times) for i in trace.followers}
    drones = {i: positions(trace, i, times) for i in trace.followers}
    taken = taken_places(trace.swarm, times, places, drones, _inside_movers(trace, times, places))
    nearest = {number: np.searchsorted(times, error.stamps).clip(0, len(times) - 1) for number, error in errors.items()}
    free = {number: ~taken[number][steps] for number, steps in nearest.items()}
    return {i: Errors(error.stamps[free[i]], error.values[free[i]]) for i, error in errors.items()}


def taken_places(
    swarm: Swarm, times: Integers, places: dict[int, Floats], drones: dict[int, Floats], inside: dict[int, Floats]
) -> dict[int, Booleans]:
    """Return at which of `times` (Unix ns, equal steps) each follower's place is not free.

    `places` and `drones`: positions by number, m, shape n x 3, NaN if unknown; `inside`: by number, how far a place
    lies within the influence radius of what is no obstacle of the swarm file, m, -inf: of nothing.
    """
    avoidance, pushed = swarm.avoidance, dict(inside)
    if swarm.obstacles:
        for i, place in places.items():
            surfaces = avoidance.obstacle_influence_radius - nearest_surface(place, swarm.obstacles)
            pushed[i] = np.fmax(pushed[i], surfaces)
    away = {i: norms(drones[i] - place) > SETTLED_BELOW for i, place in places.items()}
    taken = {i: _around(swarm.limits.speed, times, place, pushed[i]) for i, place in places.items()}
    growing = [i for i in taken if taken[i].any()]
    while growing:
        pushing = growing.pop()
        off = taken[pushing] & away[pushing]
        for i, place in places.items():
            depth = np.where(off, avoidance.drone_influence_radius - norms(drones[pushing] - place), -np.inf)
            if i != pushing and (depth > np.maximum(pushed[i], 0.0)).any():
                pushed[i] = np.fmax(pushed[i], depth)
                before, taken[i] = taken[i], _around(swarm.limits.speed, times, place, pushed[i])
                if i not in growing and (taken[i] & ~before).any():
                    growing.append(i)
    return taken


def _around(limit: float, times: Integers, place: Floats, inside: Floats) -> Booleans:
    """Return when a place is not free: while it is inside, and for the ways before and after it."""
    settling = 3 * SECOND  # ns
    slowest = 0.1  # share of the speed limit that v is at least
    moves = np.gradient(place, (times - times[0]) / SECOND, axis=0) if len(times) > 1 else np.zeros((1, 3))
    speed = np.nan_to_num(norms(moves))
    ways = pi / 2 * np.maximum(inside, 0.0) / np.maximum(limit - speed, slowest * limit) * SECOND
    last = np.maximum.accumulate(np.where(inside > 0.0, times + ways + settling, -np.inf))
    first = np.minimum.accumulate(np.where(inside > 0.0, times - ways, np.inf)[::-1])[::-1]
    return np.asarray((times <= last) | (times >= first))


def _inside_movers(trace: Trace, times: Integers, places: dict[int, Floats]) -> dict[int, Floats]:
    """Return how far each place lies within the influence radius of moving bodies, m, -inf without one."""
    reach = trace.swarm.avoidance.obstacle_influence_radius
    found = {i: np.full(len(times), -np.inf) for i in places}
    for index, bodies in moving_bodies(trace, times):
        for i, place in places.items():
            gaps = [np.hypot(place[index, 0] - one.x, place[index, 1] - one.y) - one.radius for one in bodies]
            found[i][index] = np.fmax(found[i][index], reach - min(gaps))
    return found
