"""Trackers of a measured point: its position and velocity (and acceleration) from stamped positions alone."""

from __future__ import annotations

from math import exp

from flockwire.control.vector import ZERO, Vector


class VelocityTracker:
    """A critically damped alpha-beta tracker of `time_constant` T (s), from its first position on.

        x <- x + dt v,   r = z − x,   x <- x + alpha r,   v <- v + beta r / dt
        alpha = 1 − q^2,   beta = (1 − q)^2,   q = e^(−dt/T)

    Until enough positions have come the gains are those of a least-squares line, 2 (2k − 1) / (k (k + 1)) and
    6 / (k (k + 1)) for the k-th position. A body that accelerates at a is seen a T^2 behind and 2 a T too slow.
    """

    def __init__(self, time_constant: float, position: Vector, stamp: float) -> None:
        self.position, self.velocity, self.stamp = position, ZERO, stamp
        self._time_constant, self._count = time_constant, 1

    def update(self, position: Vector, stamp: float) -> None:
        """Take the `position` (m) measured at `stamp` (s); one that is not newer than the last is left out."""
        dt = stamp - self.stamp
        if dt <= 0.0:
            return
        q = exp(-dt / self._time_constant)
        alpha, beta = 1.0 - q * q, (1.0 - q) ** 2
        if self._count:
            k = self._count = self._count + 1
            line = 2.0 * (2 * k - 1) / (k * (k + 1))
            if line > alpha:
                alpha, beta = line, 6.0 / (k * (k + 1))
            else:
                self._count = 0
        x, v = self.position, self.velocity
        share = beta / dt
        px, py, pz = x[0] + dt * v[0], x[1] + dt * v[1], x[2] + dt * v[2]
        rx, ry, rz = position[0] - px, position[1] - py, position[2] - pz
        self.position = (px + alpha * rx, py + alpha * ry, pz + alpha * rz)
        self.velocity = (v[0] + share * rx, v[1] + share * ry, v[2] + share * rz)
        self.stamp = stamp


class AccelerationTracker:
    """As VelocityTracker, of third order: velocity and acceleration of a point whose acceleration changes slowly.

        x <- x + dt v + dt^2 a / 2,   v <- v + dt a,   r = z − x
        x <- x + (1 − q^3) r,   v <- v + 3/2 (1 − q)^2 (1 + q) r / dt,   a <- a + (1 − q)^3 r / dt^2,   q = e^(−dt/T)

    Three equal poles: no overshoot from noise, exact for constant acceleration. The first positions begin it as a line.
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
        self.position, self.velocity, self.acceleration = zip(
            *(
                _corrected(z, x, v, a, dt, alpha, beta, gamma)
                for z, x, v, a in zip(position, self.position, self.velocity, self.acceleration, strict=True)
            ),
            strict=True,
        )


def _corrected(
    z: float, x: float, v: float, a: float, dt: float, alpha: float, beta: float, gamma: float
) -> tuple[float, float, float]:
    x += dt * (v + 0.5 * dt * a)
    v += dt * a
    r = z - x
    return x + alpha * r, v + beta * r, a + gamma * r
