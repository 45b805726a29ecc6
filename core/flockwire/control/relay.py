"""The extended observer: what is relayed from hop to hop is the leader's motion, not its last position.

eta_j(now) = eta_j + tau v_j + tau^2 a_j / 2,   tau = now − stamp_j        (theory: docs/theory.md)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from flockwire.control.observer import ObserverParameters, implicit_step
from flockwire.control.vector import ZERO, Vector


class LeaderMotion(NamedTuple):
    """An estimate of the leader: position, m, velocity, m/s, acceleration, m/s^2, world frame."""

    position: Vector
    velocity: Vector = ZERO
    acceleration: Vector = ZERO

    def after(self, dt: float) -> LeaderMotion:
        """Return the motion `dt` s later: x + dt v + dt^2 a / 2, v + dt a, a."""
        x, v, a = self.position, self.velocity, self.acceleration
        half = 0.5 * dt * dt
        return LeaderMotion(
            (x[0] + dt * v[0] + half * a[0], x[1] + dt * v[1] + half * a[1], x[2] + dt * v[2] + half * a[2]),
            (v[0] + dt * a[0], v[1] + dt * a[1], v[2] + dt * a[2]),
            a,
        )


def relay_step(
    own: LeaderMotion,
    neighbour_estimates: Sequence[tuple[float, LeaderMotion]],
    parameters: ObserverParameters,
    dt: float,
) -> LeaderMotion:
    """Advance the own estimate by `dt` s: predict, then correct by the observer (8) on the neighbours' estimates.

        eta_i <- eta_i + dt v_i + dt^2 a_i / 2,   then one implicit step of (8)
        v_i = sum_j w_ij v_j / sum_j w_ij,   a_i likewise

    `neighbour_estimates` is one (w_ij, motion) for each neighbour, each extrapolated to this step's time. Velocity and
    acceleration are passed on, never differentiated again: noise enters once, at the leader's pose, and is filtered
    once. Without any the estimate coasts on at its velocity.
    """
    total = sum(w for w, _ in neighbour_estimates)
    if not total:
        return LeaderMotion(own.position, own.velocity).after(dt)
    position = implicit_step(own.after(dt).position, [(w, m.position) for w, m in neighbour_estimates], parameters, dt)
    if len(neighbour_estimates) == 1:
        return LeaderMotion(position, neighbour_estimates[0][1].velocity, neighbour_estimates[0][1].acceleration)
    vx = vy = vz = ax = ay = az = 0.0
    for w, motion in neighbour_estimates:
        share, v, a = w / total, motion.velocity, motion.acceleration
        vx, vy, vz = vx + share * v[0], vy + share * v[1], vz + share * v[2]
        ax, ay, az = ax + share * a[0], ay + share * a[1], az + share * a[2]
    return LeaderMotion(position, (vx, vy, vz), (ax, ay, az))
