"""The artificial potential Q that pushes a follower away from other followers and from obstacles."""

from collections.abc import Iterable
from math import hypot
from typing import NamedTuple

from flockwire_core.domain.body import Body, BodyKind, to_surface
from flockwire_core.domain.vector import ZERO, Vector, add


class PotentialParameters(NamedTuple):
    """Gains K_uav and K_obs of the potentials in (9), and the radii of influence rho_uav and rho_obs, m."""

    drone_gain: float
    drone_influence_radius: float
    obstacle_gain: float
    obstacle_influence_radius: float


def potential_gradient(separation: Vector, gain: float, influence_radius: float) -> Vector:
    """Return the gradient dQ/dx_i of the potential Q_ij or Q_ik; it points towards the other body, (9) subtracts it.

        Q = K/2 (1/d − 1/rho)^2   for 0 < d < rho, else 0
        dQ/dx_i = −K (1/d − 1/rho) / d^2 · (x_i − x_j) / d   for 0 < d < rho, else 0

    `separation` is x_i − x_j (or x_i − o_k) in m, world frame, d its norm; `gain` K_uav or K_obs,
    `influence_radius` rho > 0 in m. Zero for coincident bodies (within a micrometre), where the direction is undefined.
    """
    x, y, z = separation
    d = hypot(x, y, z)
    if not 1e-6 < d < influence_radius:  # m: closer than this, the direction between two bodies is noise
        return ZERO
    factor = -gain * (1.0 / d - 1.0 / influence_radius) / (d * d * d)
    return (factor * x, factor * y, factor * z)


def repulsion(bodies: Iterable[Body], parameters: PotentialParameters) -> Vector:
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
