"""The bodies near a drone: sensed, or known without a sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from flockwire_core.domain.body import Body, BodyKind, Nearby, to_axis
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from flockwire_core.pilot.phases import age
from flockwire_core.swarm.tables import Obstacle


class Surroundings:
    """The bodies near one drone, relative to its newest pose: sensed ones, or its neighbours and `obstacles`."""

    def __init__(self, sensing: bool, obstacles: tuple[Obstacle, ...]) -> None:
        self._sensing, self._obstacles = sensing, obstacles
        self._nearby: Nearby | None = None
        self._before: Nearby | None = None
        self._seen_from: tuple[int, Vector] = (0, ZERO)  # stamp and own position of a pose

    @property
    def stamp(self) -> int:
        """The stamp of the sensed bodies, Unix ns; 0 without sensing."""
        return self._nearby.stamp if self._nearby is not None else 0

    def age(self, now: int) -> float:
        """Return the age of the sensed bodies at `now` (Unix ns), s; 0 without sensing."""
        return age(self.stamp, now) if self._sensing else 0.0

    def take_nearby(self, nearby: Nearby) -> None:
        """Receive the newest message of the sensor."""
        self._before, self._nearby = self._nearby, nearby

    def drop(self, stamp: int) -> None:
        """Drop the bodies of `stamp` (Unix ns): they are seen from a pose that is not the drone's."""
        if self.stamp == stamp:
            self._nearby = self._before

    def bodies(self, pose: Pose, neighbours: Callable[[], list[Vector]]) -> Sequence[Body]:
        """Return the bodies relative to `pose`; bodies seen from an earlier position are shifted by the displacement.

        `neighbours` returns the positions known without a sensor (m, world frame).
        """
        if not self._sensing:
            return known_bodies(pose.position, neighbours(), self._obstacles)
        if self._nearby is None:
            return ()
        if self._nearby.stamp == pose.stamp:
            self._seen_from = (pose.stamp, pose.position)
            return self._nearby.bodies
        stamp, place = self._seen_from
        if stamp != self._nearby.stamp:
            return self._nearby.bodies
        displacement = subtract(place, pose.position)
        return [
            body._replace(relative_position=add(body.relative_position, displacement)) for body in self._nearby.bodies
        ]


def known_bodies(position: Vector, neighbours: Iterable[Vector], obstacles: Iterable[Obstacle]) -> list[Body]:
    """Return the bodies that are known without a sensor: the neighbours' positions and the mapped obstacles."""
    drones = [Body(BodyKind.DRONE, subtract(other, position), 0.0) for other in neighbours]
    mapped = [
        Body(BodyKind.OBSTACLE, to_axis(position, obstacle.center, obstacle.height), obstacle.radius)
        for obstacle in obstacles
    ]
    return drones + mapped
