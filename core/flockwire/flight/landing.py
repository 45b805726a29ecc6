"""Where a drone comes down: on its place, or where a body is below that, on the nearest free one."""

from __future__ import annotations

from collections.abc import Sequence

from flockwire.control.free_place import is_free, nearest_free_place
from flockwire.control.vector import Vector
from flockwire.swarm.model import Swarm
from flockwire.wire.messages import Body, BodyKind

SPARE = 0.1  # m beyond what the safety filter keeps: the tracker's noise must not make a chosen place occupied again


class Landing:
    """The places on the ground that the bodies near one drone of `swarm` leave free."""

    def __init__(self, swarm: Swarm) -> None:
        safe = swarm.avoidance
        self._drone_distance = safe.drone_distance_kept
        self._obstacle_distance = safe.obstacle_distance_kept
        self._room = swarm.limits.fence.room()

    def place(self, position: Vector, place: Vector, bodies: Sequence[Body]) -> tuple[Vector, bool]:
        """Return the place to come down on, and whether the way down from `position` is free.

        Another one than `place` (m, world frame) where that, or the way down, is occupied: then the free one that is
        nearest to `position`. `bodies` are relative to `position`; those above it are not in the way. Where no place
        is free it is `place`, straight down: the safety filter keeps clear all the same.
        """
        if not bodies:
            return place, True
        x, y, _ = position
        discs = [
            (x + body.relative_position[0], y + body.relative_position[1], self._distance(body))
            for body in bodies
            if body.relative_position[2] <= 0.0
        ]
        free = is_free((x, y), discs)
        if free and is_free((place[0], place[1]), discs):
            return place, True
        chosen = nearest_free_place((x, y), [(a, b, r + SPARE) for a, b, r in discs], self._room)
        return (place, True) if chosen is None else ((chosen[0], chosen[1], place[2]), free)

    def _distance(self, body: Body) -> float:
        return self._drone_distance if body.kind is BodyKind.DRONE else self._obstacle_distance + body.radius
