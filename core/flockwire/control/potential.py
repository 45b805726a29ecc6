"""The artificial potential Q that pushes a follower away from other followers and from obstacles."""

from math import hypot

from flockwire.control.vector import ZERO, Vector

_COINCIDENT = 1e-6
"""Metres: closer than this, the direction between two bodies is noise."""


def potential(distance: float, gain: float, influence_radius: float) -> float:
    """Return the potential Q_ij or Q_ik of the protocol (9).

        Q = K/2 (1/d − 1/rho)^2   for 0 < d < rho, else 0

    `distance` is d in m, `gain` K_uav or K_obs, `influence_radius` rho > 0 in m.
    """
    if not _COINCIDENT < distance < influence_radius:
        return 0.0
    return 0.5 * gain * (1.0 / distance - 1.0 / influence_radius) ** 2


def potential_gradient(separation: Vector, gain: float, influence_radius: float) -> Vector:
    """Return the gradient dQ/dx_i of the potential; it points towards the other body, (9) subtracts it.

        dQ/dx_i = −K (1/d − 1/rho) / d^2 · (x_i − x_j) / d   for 0 < d < rho, else 0

    `separation` is x_i − x_j (or x_i − o_k) in m, world frame, d its norm; the other arguments as for `potential`.
    Zero for coincident bodies (within a micrometre), where the direction is undefined.
    """
    x, y, z = separation
    d = hypot(x, y, z)
    if not _COINCIDENT < d < influence_radius:
        return ZERO
    factor = -gain * (1.0 / d - 1.0 / influence_radius) / (d * d * d)
    return (factor * x, factor * y, factor * z)
