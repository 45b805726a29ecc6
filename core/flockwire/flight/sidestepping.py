"""How a drone gets round what is in its way: the sidestep, from the bodies that are near."""

from __future__ import annotations

from collections.abc import Sequence

from flockwire.control.obstacle import to_surface
from flockwire.control.sidestep import Impatience, sidestep
from flockwire.control.vector import Vector, norm, scale
from flockwire.swarm.tables import Avoidance
from flockwire.wire.messages import Body, BodyKind


class Sidestepper:
    """Turns a drone's corrections round what is in its way; the other way after `patience` s without progress."""

    def __init__(self, avoidance: Avoidance, patience: float) -> None:
        self._avoidance = avoidance
        self._impatience = Impatience(patience)

    def turned(self, correction: Vector, bodies: Sequence[Body], to_go: float, now: float) -> Vector:
        """Return `correction`, m/s, turned round `bodies`; `to_go` m that become less are progress; `now` in s."""
        safe = self._avoidance
        directions = []
        for body in bodies:
            away = to_surface(body.relative_position, body.radius)
            distance = norm(away)
            drone = body.kind is BodyKind.DRONE
            gap = distance - (safe.drone_safety_distance if drone else safe.obstacle_safety_distance)
            directions.append((scale(away, -1.0 / max(distance, 1e-9)), gap))
        turned = sidestep(correction, directions, safe.sidestep_reach, self._impatience.side)
        self._impatience.update(to_go, turned != correction, now)
        return turned
