"""What each drone sees of others as its law declares it: relative, at one time for both ends, and no more."""

from __future__ import annotations

from typing import Final

from flockwire_core.control.tracker import AccelerationTracker
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector, distance, subtract
from flockwire_core.law import Seen, Sense
from flockwire_core.process.cores import Randomness
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.information import information_of
from flockwire_core.wire.sighting import Sighting, sensed

from flockwire_mocap.field_bodies import FEW, Vicinity
from flockwire_mocap.tracking import Drone, noisy

FORGET: Final = SECOND  # ns unseen after which a track restarts


Here = dict[int, tuple[Vector, Vector]]
"""Position (m) and velocity (m/s) of each drone that is not lost."""


class Track:
    """One drone as the tracker sees it."""

    def __init__(self, position: Vector, stamp: int) -> None:
        self.position, self.stamp = position, stamp  # m; Unix ns
        self._epoch = stamp
        # s, of the trackers: their velocity is not late while the acceleration is constant
        self._tracker = AccelerationTracker(0.05, position, 0.0)

    def update(self, position: Vector, stamp: int) -> None:
        """Receive a newer position, m."""
        self.position, self.stamp = position, stamp
        self._tracker.update(position, (stamp - self._epoch) / SECOND)

    def at(self, stamp: int) -> tuple[Vector, Vector]:
        """Return position, m, and velocity, m/s, predicted to `stamp`; at the time of a pose, that pose."""
        dt = (stamp - self.stamp) / SECOND
        x, v, a = self.position, self._tracker.velocity, self._tracker.acceleration
        half = 0.5 * dt * dt
        return (
            (x[0] + dt * v[0] + half * a[0], x[1] + dt * v[1] + half * a[1], x[2] + dt * v[2] + half * a[2]),
            (v[0] + dt * a[0], v[1] + dt * a[1], v[2] + dt * a[2]),
        )


class RelativeSensor:
    """The relative sensors of all followers of `swarm`.

    Both ends of an edge are taken at the time of the newest pose of a step: those of one tracker frame are as
    measured, a body reported by itself, or lost for less than `staleness.pose_zero`, is predicted to it. What a drone
    sees has the noise of [sensing], drawn from `chance`: that of both ends differs.
    """

    def __init__(self, swarm: Swarm, chance: Randomness | None = None) -> None:
        self._noises = (swarm.sensing.noise, swarm.sensing.velocity_noise)  # m; m/s
        self._chance = chance if any(self._noises) else None
        self._declared, self._frame = information_of(swarm), swarm.frame
        seen = self._declared.neighbours is not Sense.NOTHING
        self._radius = self._declared.radius if self._declared.around is not Sense.NOTHING else 0.0  # m
        self._neighbours = {i: tuple(swarm.topology.neighbours(i) if seen else ()) for i in swarm.followers}
        self._lost_after = nanoseconds(swarm.limits.staleness.pose_zero)
        self._tracks: dict[int, Track] = {}

    def see(self, tracked: list[Drone]) -> dict[int, Sighting]:
        """Receive a step's drones, in order of time; return what each follower among them sees."""
        for drone, pose in tracked:
            self._update(drone, pose.position, pose.stamp)
        if not tracked:
            return {}
        stamp = tracked[-1][1].stamp
        here = {j: one.at(stamp) for j, one in self._tracks.items() if stamp - one.stamp <= self._lost_after}
        seeing = [i for i in dict.fromkeys([drone for drone, _ in tracked]) if i in self._neighbours and i in here]
        near = self._near(seeing, here)
        return {i: self._sighting(i, near.get(i, []), here, stamp) for i in seeing}

    def _sighting(self, i: int, near: list[int], here: Here, stamp: int) -> Sighting:
        declared = self._declared
        neighbours = [self._seen(i, j, here, stamp, declared.neighbours) for j in self._neighbours[i] if j in here]
        around = [self._seen(i, j, here, stamp, declared.around, declared.named) for j in near]
        return Sighting(stamp, self._frame, tuple(neighbours), tuple(around))

    def _update(self, drone: int, position: Vector, stamp: int) -> None:
        track = self._tracks.get(drone)
        if track is not None and stamp - track.stamp < FORGET:
            track.update(position, stamp)
        else:
            self._tracks[drone] = Track(position, stamp)

    def _near(self, seeing: list[int], here: Here) -> dict[int, list[int]]:
        """Return who is within the radius of each drone, nobody if the law does not see around."""
        radius, drones = self._radius, list(here)
        if radius <= 0.0:
            return {}
        vicinity = Vicinity([here[j][0] for j in drones], radius) if len(drones) > FEW else None
        near: dict[int, list[int]] = {}
        for i in seeing:
            place = here[i][0]
            others = drones if vicinity is None else [drones[k] for k in vicinity.round(place)]
            near[i] = [j for j in others if j != i and distance(place, here[j][0]) < radius]
        return near

    def _seen(self, i: int, j: int, here: Here, stamp: int, sense: Sense, named: bool = True) -> Seen:
        """Return what drone i senses of drone j, and nothing else."""
        own, own_velocity = here[i]
        other, velocity = here[j]
        age = (stamp - min(self._tracks[i].stamp, self._tracks[j].stamp)) / SECOND
        place, rate = subtract(other, own), subtract(velocity, own_velocity)
        if self._chance is not None:
            place = noisy(place, self._noises[0], self._chance)
            rate = noisy(rate, self._noises[1], self._chance)
        return sensed(sense, j if named else -1, place, rate, age)
