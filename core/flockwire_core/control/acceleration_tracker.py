"""A tracker of a measured point that accelerates: position, velocity and acceleration from stamped positions."""

from __future__ import annotations

from math import exp

from flockwire_core.control.tracker import VelocityTracker
from flockwire_core.domain.vector import ZERO, Vector


class AccelerationTracker:
    """As VelocityTracker, of third order: velocity and acceleration of a point whose acceleration changes slowly.

        x <- x + dt v + dt^2 a / 2,   v <- v + dt a,   r = z − x
        x <- x + (1 − q^3) r,   v <- v + 3/2 (1 − q)^2 (1 + q) r / dt,   a <- a + (1 − q)^3 r / dt^2,   q = e^(−dt/T)

    Three equal poles: no overshoot from noise, exact for constant acceleration. It starts as a line through the first
    positions.
    """

    def __init__(self, time_constant: float, position: Vector, stamp: float) -> None:
        self._start = VelocityTracker(time_constant, position, stamp)
        self.position, self.velocity, self.acceleration, self.stamp = position, ZERO, ZERO, stamp
        self._time_constant, self._begun = time_constant, stamp

    def update(self, position: Vector, stamp: float) -> None:
        """Take the `position` (m) measured at `stamp` (s); one that is not newer than the last is left out."""
        dt = stamp - self.stamp
        if dt <= 0.0:
            return
        self.stamp = stamp
        if stamp - self._begun < 2.0 * self._time_constant:
            self._start.update(position, stamp)
            self.position, self.velocity = self._start.position, self._start.velocity
            return
        q = exp(-dt / self._time_constant)
        alpha, beta, gamma = 1.0 - q**3, 1.5 * (1.0 - q) ** 2 * (1.0 + q) / dt, (1.0 - q) ** 3 / (dt * dt)
        p, v, a = self.position, self.velocity, self.acceleration
        x = _corrected(position[0], p[0], v[0], a[0], dt, alpha, beta, gamma)
        y = _corrected(position[1], p[1], v[1], a[1], dt, alpha, beta, gamma)
        z = _corrected(position[2], p[2], v[2], a[2], dt, alpha, beta, gamma)
        self.position, self.velocity, self.acceleration = (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def _corrected(
    z: float, x: float, v: float, a: float, dt: float, alpha: float, beta: float, gamma: float
) -> tuple[float, float, float]:
    x += dt * (v + 0.5 * dt * a)
    v += dt * a
    r = z - x
    return x + alpha * r, v + beta * r, a + gamma * r
