"""Whose place is free: the error of a follower counts for its law only where it is.

A place x_0 + h_i is taken while it is within the influence radius of an obstacle, of a moving body, or of a drone that
is off its own place for this reason. With s, the distance that it lies inside that radius, and v, by how much the speed
limit exceeds the speed of the place, the follower may be away from

    pi/2 s / v before    to    pi/2 s / v + SETTLING after:

the way out and back, round a body at most, and the time in which a law converges. Nothing of it depends on what the
follower itself does.
"""

from __future__ import annotations

from math import pi

import numpy as np
from flockwire.domain.time import SECOND

from flockwire_analysis.moving_bodies import moving_bodies
from flockwire_analysis.phases import formation_phases
from flockwire_analysis.recorded import Trace
from flockwire_analysis.separation import nearest_surface, own_places
from flockwire_analysis.series import Booleans, Floats, Integers
from flockwire_analysis.tracking import SETTLED_BELOW, Errors, interpolated

STEP = SECOND // 20  # ns
SETTLING = 3 * SECOND  # ns
SLOWEST = 0.1  # share of the speed limit that v is at least


def undisturbed(trace: Trace, errors: dict[int, Errors]) -> dict[int, Errors]:
    """Return `errors` without the samples of followers whose places were not free."""
    times = _times(trace)
    if not len(times) or not (trace.swarm.obstacles or trace.movers):
        return errors
    taken = _Places(trace, times).taken()
    nearest = {number: np.searchsorted(times, error.stamps).clip(0, len(times) - 1) for number, error in errors.items()}
    free = {number: ~taken[number][steps] for number, steps in nearest.items()}
    return {i: Errors(error.stamps[free[i]], error.values[free[i]]) for i, error in errors.items()}


def _times(trace: Trace) -> Integers:
    """Return instants of all formation phases, Unix ns."""
    spans = [phase.span for phase in formation_phases(trace)]
    return np.arange(spans[0].begin, spans[-1].end + STEP, STEP, dtype=np.int64) if spans else np.empty(0, np.int64)


class _Places:
    """The followers' places at `times` (Unix ns, equal steps), and how far they lie in the reach of others, m."""

    def __init__(self, trace: Trace, times: Integers) -> None:
        self._trace, self._times = trace, times
        self._places = {i: own_places(trace, i, times) for i in trace.followers}
        self._drones = {i: interpolated(trace.positions(i), times) for i in trace.followers}
        self._away = {i: _distances(self._drones[i], self._places[i]) > SETTLED_BELOW for i in trace.followers}
        self._inside = self._inside_bodies()

    def taken(self) -> dict[int, Booleans]:
        """Return at which of the times each follower's place is not free."""
        reach = self._trace.swarm.avoidance.drone_influence_radius
        taken = {i: self._taken(i) for i in self._places}
        growing = [i for i in taken if taken[i].any()]
        while growing:
            pushing = growing.pop()
            off = taken[pushing] & self._away[pushing]
            for i in self._places:
                inside = np.where(off, reach - _distances(self._drones[pushing], self._places[i]), -np.inf)
                if i != pushing and (inside > np.maximum(self._inside[i], 0.0)).any():
                    self._inside[i] = np.fmax(self._inside[i], inside)
                    before, taken[i] = taken[i], self._taken(i)
                    if i not in growing and (taken[i] & ~before).any():
                        growing.append(i)
        return taken

    def _taken(self, number: int) -> Booleans:
        """Return when a place is not free: while it is inside, and for the ways before and after it."""
        limit, inside = self._trace.swarm.limits.speed, self._inside[number]
        moves = np.gradient(self._places[number], STEP / SECOND, axis=0) if len(self._times) > 1 else np.zeros((1, 3))
        speed = np.nan_to_num(np.sqrt(np.sum(moves**2, axis=1)))
        ways = pi / 2 * np.maximum(inside, 0.0) / np.maximum(limit - speed, SLOWEST * limit) * SECOND
        last = np.maximum.accumulate(np.where(inside > 0.0, self._times + ways + SETTLING, -np.inf))
        first = np.minimum.accumulate(np.where(inside > 0.0, self._times - ways, np.inf)[::-1])[::-1]
        return np.asarray((self._times <= last) | (self._times >= first))

    def _inside_bodies(self) -> dict[int, Floats]:
        """Return how far each place lies within the influence radius of obstacles and moving bodies."""
        trace, reach = self._trace, self._trace.swarm.avoidance.obstacle_influence_radius
        found = {i: np.full(len(self._times), -np.inf) for i in self._places}
        if trace.swarm.obstacles:
            found = {i: reach - nearest_surface(places, trace.swarm.obstacles) for i, places in self._places.items()}
        for index, bodies in moving_bodies(trace, self._times):
            for i, places in self._places.items():
                gaps = [np.hypot(places[index, 0] - one.x, places[index, 1] - one.y) - one.radius for one in bodies]
                found[i][index] = np.fmax(found[i][index], reach - min(gaps))
        return {i: np.nan_to_num(inside, nan=-np.inf, neginf=-np.inf) for i, inside in found.items()}


def _distances(some: Floats, others: Floats) -> Floats:
    return np.asarray(np.sqrt(np.sum((some - others) ** 2, axis=1)))
