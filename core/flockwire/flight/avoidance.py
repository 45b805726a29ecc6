"""The repulsion in (9): the summed gradient of the potentials of everything that is near."""

from __future__ import annotations

from collections.abc import Iterable

from flockwire.control.obstacle import to_axis, to_surface
from flockwire.control.potential import potential_gradient
from flockwire.control.vector import ZERO, Vector, add, subtract
from flockwire.swarm.tables import Avoidance, Obstacle
from flockwire.wire.messages import Body, BodyKind


def repulsion(bodies: Iterable[Body], parameters: Avoidance) -> Vector:
    """Return sum_j dQ_ij/dx_i + sum_k dQ_ik/dx_i of (9), m; it points towards the bodies, (9) subtracts it."""
    total = ZERO
    for body in bodies:
        x, y, z = to_surface(body.relative_position, body.radius) if body.radius else body.relative_position
        if body.kind is BodyKind.DRONE:
            gain, radius = parameters.drone_gain, parameters.drone_influence_radius
        else:
            gain, radius = parameters.obstacle_gain, parameters.obstacle_influence_radius
        total = add(total, potential_gradient((-x, -y, -z), gain, radius))
    return total


def known_bodies(position: Vector, neighbours: Iterable[Vector], obstacles: Iterable[Obstacle]) -> list[Body]:
    """Return the bodies an agent knows of without a sensor: its neighbours' positions and the mapped obstacles."""
    drones = [Body(BodyKind.DRONE, subtract(other, position), 0.0) for other in neighbours]
    mapped = [
        Body(BodyKind.OBSTACLE, to_axis(position, obstacle.center, obstacle.height), obstacle.radius)
        for obstacle in obstacles
    ]
    return drones + mapped
