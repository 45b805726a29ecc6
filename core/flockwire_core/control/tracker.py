"""Trackers of measured points: position, velocity and acceleration from stamped positions, with or without names."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp
from typing import Final

from flockwire_core.domain.vector import ZERO, Vector, distance

GATE: Final = 0.3  # m: a body farther than this from the prediction of every known one is new


class VelocityTracker:
    """A critically damped alpha-beta tracker of `time_constant` T (s), from its first position on.

        x <- x + dt v,   r = z − x,   x <- x + alpha r,   v <- v + beta r / dt
        alpha = 1 − q^2,   beta = (1 − q)^2,   q = e^(−dt/T)

    For the first positions the gains are those of a least-squares line, 2 (2k − 1) / (k (k + 1)) and 6 / (k (k + 1))
    for the k-th position. For a body that accelerates at a, the position is a T^2 behind and the velocity 2 a T too
    low.
    """

    def __init__(self, time_constant: float, position: Vector, stamp: float) -> None:
        self.position, self.velocity, self.stamp = position, ZERO, stamp
        self._time_constant, self._count = time_constant, 1

    @property
    def is_new(self) -> bool:
        """Whether it has one position only, and so no velocity yet."""
        return self._count == 1

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


class BodyTracks:
    """Tracks bodies by position alone: each new position belongs to the track with the nearest prediction.

    `time_constant` (s) is that of the trackers. The bodies of one call keep their order in its result.
    """

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self._tracks: list[VelocityTracker] = []
        self._stamp = 0.0

    def update(self, positions: Sequence[Vector], stamp: float) -> list[Vector]:
        """Return the velocity, m/s, of each of `positions` (m, world frame) seen at `stamp` (s); 0 for a new body."""
        if stamp > self._stamp or len(positions) != len(self._tracks):
            self._match(positions, stamp)
            self._stamp = stamp
        return [track.velocity for track in self._tracks]

    def is_new(self, place: int) -> bool:
        """Return whether the body at `place` of the last call was new then."""
        return place < len(self._tracks) and self._tracks[place].is_new

    def _match(self, positions: Sequence[Vector], stamp: float) -> None:
        """Assign each position to a track; the body's last index is tried first."""
        predicted = [_ahead(track, stamp) for track in self._tracks]
        free = set(range(len(predicted)))
        tracks: list[VelocityTracker] = []
        for place, position in enumerate(positions):
            best = place if place in free and distance(predicted[place], position) < 0.1 * GATE else None
            if best is None:
                best = min(free, key=lambda k: distance(predicted[k], position), default=None)
                if best is not None and distance(predicted[best], position) > GATE:
                    best = None
            if best is None:
                tracks.append(VelocityTracker(self._time_constant, position, stamp))
            else:
                free.discard(best)
                self._tracks[best].update(position, stamp)
                tracks.append(self._tracks[best])
        self._tracks = tracks


def _ahead(track: VelocityTracker, stamp: float) -> Vector:
    dt = stamp - track.stamp
    x, v = track.position, track.velocity
    return (x[0] + dt * v[0], x[1] + dt * v[1], x[2] + dt * v[2])
