"""A rehearsal of a change of formation: assignment of places, and limits in steps of STEP.

It checks speed, acceleration, spacing and fence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from itertools import combinations
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flockwire_core.control.assignment import assignment
from flockwire_core.control.formation import Formation, blend, blend_rate
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add, subtract
from flockwire_core.parameters import guard_parameters
from flockwire_core.swarm.formation_rules import survey_of
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.trajectories import course_of, leader_speed
from flockwire_core.swarm.wording import beside

STEP = 0.02  # s
FENCE_STEPS = 5  # steps between two checks of the fence
BEYOND = 3  # steps that are checked before and after the change

Array = NDArray[np.float64]


class Way(NamedTuple):
    """The course of a change: `seconds` into it, h and h' by time and follower, distances by time and pair."""

    seconds: Array
    offsets: Array
    rates: Array
    gaps: Array


class Rehearsal:
    """The change from `running` to the formation `name` that begins at mission time `begin`, s."""

    def __init__(
        self, swarm: Swarm, running: Mission, name: str, begin: float, leader: Vector | None, lead: int
    ) -> None:
        self._swarm, self._begin, self._leader, self._now = swarm, begin, leader, begin - lead / SECOND
        self._fixed = swarm.formation_table(name).places == "fixed"
        self._ranks = tuple(range(len(swarm.followers)))
        self.places_before = running.change.places if running.change is not None else self._ranks
        self._before = _course(swarm.build_formation(running.formation))
        self._after = _course(swarm.build_formation(name))
        self._guards = [guard_parameters(swarm, i) for i in swarm.followers] if swarm.control.filtered else []
        self._safe = swarm.drone_spacing
        disturbance = swarm.control.compensated
        self._beside = f" and control.disturbance = {disturbance:g} m/s" if disturbance else ""
        self._speed = swarm.limits.speed - leader_speed(swarm) - disturbance
        flown = max(survey_of(swarm, each).max_speed for each in (running.formation, name))
        sight = min((guard.fastest for guard in self._guards), default=0.0) - leader_speed(swarm)
        # times the speed of either formation, up to which a change is not too fast for sensing
        self._sight = max(sight, 1.25 * flown)  # m/s, of h'
        self._lag = np.array([swarm.airframe(i).lag for i in swarm.followers])[None, :, None]
        self._course = course_of(swarm.reference)
        bodies = (*(swarm.leaders if swarm.reference.has_body else ()), *swarm.followers)
        self._pairs = tuple(combinations(bodies, 2))
        person = swarm.person_clearance + (swarm.avoidance.margin if self._guards else 0.0)
        self._least = np.array([self._safe if i in swarm.flying else person for i, _ in self._pairs])  # m, by pair
        self._ends = np.array(tuple(combinations(range(len(bodies)), 2)), dtype=np.intp).reshape(-1, 2)

    def places(self, duration: float) -> tuple[int, ...]:
        """Return the rank of each follower in the new formation, with the least crossing of paths."""
        if self._fixed:
            return self._ranks
        middle = np.array([self._begin + duration / 2.0])
        now, then = self._before(middle)[0], self._after(middle)[0]
        return assignment(now[0, self.places_before, :].tolist(), then[0].tolist())

    def way(self, duration: float) -> Way:
        """Return h, h' and all distances along a change of `duration` s, as in FormationChange."""
        seconds: Array = STEP * np.arange(-BEYOND, ceil(duration / STEP) + BEYOND + 1, dtype=np.float64)
        times, places = self._begin + seconds, self.places(duration)
        (a, a_rate), (b, b_rate) = self._before(times), self._after(times)
        a, a_rate = a[:, self.places_before, :], a_rate[:, self.places_before, :]
        b, b_rate = b[:, places, :], b_rate[:, places, :]
        shares = np.clip(seconds / duration, 0.0, 1.0).tolist()
        sigma = np.array([blend(s) for s in shares])[:, None, None]
        rate = np.array([blend_rate(s) / duration for s in shares])[:, None, None]
        offsets, rates = a + sigma * (b - a), a_rate + sigma * (b_rate - a_rate) + rate * (b - a)
        bodies = self._with_leader(offsets)
        one, other = np.triu_indices(bodies.shape[1], 1)
        gaps = np.array([np.linalg.norm(points[one] - points[other], axis=1) for points in bodies])
        return Way(seconds, offsets, rates, gaps)

    def _with_leader(self, values: Array) -> Array:
        """Put the leader's zeros before the followers' `values` if it has a body."""
        if not self._swarm.reference.has_body:
            return values
        return np.concatenate([np.zeros((len(values), 1, 3)), values], axis=1)

    def too_fast(self, way: Way) -> Iterator[str]:
        """Yield drones whose velocity, command or acceleration is too high."""
        limits, seconds = self._swarm.limits, way.seconds
        commands = way.rates + self._lag * np.gradient(way.rates, STEP, axis=0)
        speeds = np.maximum(np.linalg.norm(way.rates, axis=2), np.linalg.norm(commands, axis=2))
        if (speeds > self._speed).any():
            k, i = np.unravel_index(np.argmax(speeds), speeds.shape)
            speed = beside(speeds[k, i], self._speed)
            yield (
                f"{self._name(i)} would be commanded {speed} m/s {seconds[k]:.1f} s into the change, "
                f"limits.speed = {limits.speed:g} m/s leaves {self._speed:.2f} m/s beside the leader's "
                f"{leader_speed(self._swarm):.2f} m/s{self._beside}"
            )
        turns = np.linalg.norm(np.gradient(commands, STEP, axis=0), axis=2)
        if (turns > limits.acceleration).any():
            k, i = np.unravel_index(np.argmax(turns), turns.shape)
            yield (
                f"{self._name(i)} would be commanded {turns[k, i]:.1f} m/s^2 {seconds[k]:.1f} s into the change, "
                f"limits.acceleration = {limits.acceleration:g} m/s^2"
            )

    def too_close(self, way: Way) -> Iterator[str]:
        """Yield pairs that come too close."""
        gaps, room = way.gaps, way.gaps - self._least
        if not gaps.size or room.min() >= 0.0:
            return
        k, pair = np.unravel_index(np.argmin(room), room.shape)
        one, other = map(uav, self._pairs[pair])
        rule = "avoidance.drone_safety_distance"
        if self._pairs[pair][0] not in self._swarm.flying:
            rule = "gateway.person_radius, avoidance.obstacle_safety_distance"
        gap = beside(gaps[k, pair], self._least[pair])
        yield (
            f"{one} and {other} would come within {gap} m of each other {way.seconds[k]:.1f} s into the "
            f"change, must be {self._least[pair]:g} m or more ({rule}, and margin)"
        )

    def outside(self, way: Way) -> Iterator[str]:
        """Yield drones that leave the fence; none if the leader's position is unknown."""
        if self._leader is None:
            return
        room = self._swarm.limits.fence.room()
        looks = zip(way.seconds[::FENCE_STEPS].tolist(), way.offsets[::FENCE_STEPS].tolist(), strict=True)
        for second, places in looks:
            moved = subtract(self._course.position(self._begin + second), self._course.position(self._now))
            centre = add(self._leader, moved)
            for i, (x, y, z) in enumerate(places):
                if (far := room.outside(add(centre, (x, y, z)))) > 0.0:
                    yield (
                        f"{self._name(i)} would be {far:.2f} m outside limits.fence {second:.1f} s into the change, "
                        "if the leader continues its course"
                    )
                    return

    def strain(self, way: Way) -> float:
        """Return the largest slowing, m/s, of a drone by the safety filter; or 0.

        It allows a drone to approach another at A(g) / 2 (control/barrier.py), for any motion of the other.
        """
        if not self._guards:
            return 0.0
        excess = float(np.linalg.norm(way.rates, axis=2).max()) - self._sight
        leader = leader_speed(self._swarm)
        rate, braking = min(guard.rate for guard in self._guards), self._swarm.limits.acceleration
        room, knee = np.maximum(way.gaps - self._least, 0.0), braking / rate**2
        allowed = np.where(room <= knee, rate * room, np.sqrt(2.0 * braking * np.maximum(room - 0.5 * knee, 0.0)))
        allowed = np.maximum(0.5 * allowed, 0.3)  # m/s, approach speed of drones that is always allowed
        times, pairs = np.nonzero(allowed < self._sight + leader)
        one, other = self._ends[pairs].T
        places, rates = self._with_leader(way.offsets), self._with_leader(way.rates)
        ways = (places[times, other] - places[times, one]) / way.gaps[times, pairs][:, None]
        nearing = np.maximum(np.sum(ways * rates[times, one], axis=1), -np.sum(ways * rates[times, other], axis=1))
        return max(excess, float((nearing + leader - allowed[times, pairs]).max(initial=0.0)))

    def _name(self, index: int | np.intp) -> str:
        return uav(self._swarm.followers[index])


def _course(shape: Formation) -> Callable[[Array], tuple[Array, Array]]:
    """Return the function of offsets and rates, shape (times, ranks, 3), at times (s), each evaluated once."""
    ranks = range(shape.count)
    at = cache(lambda t: ([shape.offset(i, t) for i in ranks], [shape.offset_rate(i, t) for i in ranks]))

    def course(times: Array) -> tuple[Array, Array]:
        offsets, rates = zip(*map(at, times.tolist()), strict=True)
        return np.array(offsets), np.array(rates)

    return course
