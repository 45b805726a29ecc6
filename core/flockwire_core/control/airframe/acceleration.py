"""Accelerations as commands of an airframe that takes velocities."""

from __future__ import annotations

from math import exp

from flockwire_core.domain.vector import ZERO, Vector


class AccelerationInput:
    """Turns accelerations u into velocity commands, one each `period` T (s), of an airframe with lag tau (s).

        command = w + u T / (1 − e^(−T/tau)),    w <- w + (sent − w) (1 − e^(−dt/tau))        (ours)

    w is the velocity that the airframe has reached by the commands sent, after dt s of the last one; so its lag drops
    out, and where a filter changes a command w follows what the body can reach. tau = 0: w + u T, w <- sent.
    """

    def __init__(self, lag: float, period: float) -> None:
        self._lag, self._period = lag, period
        self._reached: Vector = ZERO  # w, m/s

    def follow(self, sent: Vector, dt: float) -> None:
        """Take into account that `sent` (m/s) was the command for the last `dt` s."""
        share = self._share(dt)
        x, y, z = self._reached
        self._reached = (x + share * (sent[0] - x), y + share * (sent[1] - y), z + share * (sent[2] - z))

    def velocity(self, acceleration: Vector) -> Vector:
        """Return the velocity command, m/s, that gives `acceleration` (m/s^2) during the next period."""
        gain = self._period / self._share(self._period)
        (x, y, z), (ax, ay, az) = self._reached, acceleration
        return (x + gain * ax, y + gain * ay, z + gain * az)

    def _share(self, dt: float) -> float:
        return 1.0 - exp(-dt / self._lag) if self._lag > 0.0 else 1.0
