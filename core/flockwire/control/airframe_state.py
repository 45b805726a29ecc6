"""What an airframe with lag and dead time will still do: its velocity, and where it would come to rest."""

from __future__ import annotations

from collections import deque
from math import exp
from typing import NamedTuple

from flockwire.control.vector import ZERO, Vector


class Motion(NamedTuple):
    """Where a drone was measured, m, its velocity there, m/s, and where it would rest if told to stop now, m."""

    position: Vector
    velocity: Vector
    stopping: Vector


class AirframeState:
    """Follows one airframe by its model and its measured positions; times in s on one clock.

        lag v' + v = u(t − D),   x' = v

    The stopping point  y = x + lag v + ∫_{s−D}^{now} u  (x, v at the time s of the pose) obeys  y' = u(now)  exactly:
    whatever lag and dead time, the commands drive it without delay. The airframe's way from x to y is a chain of convex
    combinations of x, x + lag v and the commands under way.
    """

    def __init__(self, lag: float, dead_time: float, time_constant: float = 0.1) -> None:
        self._lag, self._dead_time, self._time_constant = lag, dead_time, time_constant
        self._commands: deque[tuple[float, Vector, Vector]] = deque()  # when, command, where they add up to since birth
        self._position: Vector | None = None
        self._velocity = ZERO
        self._stamp = 0.0

    @property
    def last_command(self) -> Vector:
        """The newest command, m/s."""
        return self._commands[-1][1] if self._commands else ZERO

    def command(self, velocity: Vector, now: float) -> None:
        """Take note of the command `velocity` (m/s) given at `now`."""
        self._commands.append((now, velocity, self._travelled(now)))

    def measure(self, position: Vector, stamp: float, now: float) -> Motion:
        """Take the newest `position` (m), measured at `stamp`; return the motion at `now`, before the next command."""
        dt = stamp - self._stamp
        if self._position is None or dt > 1.0:
            self._position, self._velocity, self._stamp = position, ZERO, stamp
        elif dt > 0.0:
            self._predict(stamp)
            q = exp(-dt / self._time_constant)
            self._correct(position, 1.0 - q * q, (1.0 - q) ** 2 / dt)
            self._stamp = stamp
        lag, v = self._lag, self._velocity
        x1, y1, z1 = self._travelled(now)
        x0, y0, z0 = self._travelled(self._stamp - self._dead_time)
        stopping = (
            position[0] + lag * v[0] + x1 - x0,
            position[1] + lag * v[1] + y1 - y0,
            position[2] + lag * v[2] + z1 - z0,
        )
        return Motion(position, v, stopping)

    def _travelled(self, when: float) -> Vector:
        """Return the integral of the commands up to `when`, m."""
        for begin, (ux, uy, uz), (x, y, z) in reversed(self._commands):
            if begin <= when:
                dt = when - begin
                return (x + dt * ux, y + dt * uy, z + dt * uz)
        return self._commands[0][2] if self._commands else ZERO

    def _predict(self, stamp: float) -> None:
        """Fly the model from the last measurement to `stamp`."""
        commands, at = self._commands, self._stamp
        while len(commands) > 1 and commands[1][0] + self._dead_time <= at:
            commands.popleft()
        current = ZERO
        for begin, u, _ in commands:
            effective = begin + self._dead_time
            if effective >= stamp:
                break
            if effective > at:
                self._fly(current, effective - at)
                at = effective
            current = u
        self._fly(current, stamp - at)

    def _fly(self, u: Vector, dt: float) -> None:
        assert self._position is not None  # noqa: S101  (it was measured before)
        decay = exp(-dt / self._lag) if self._lag else 0.0
        drift = self._lag * (1.0 - decay)
        p, v = self._position, self._velocity
        ex, ey, ez = v[0] - u[0], v[1] - u[1], v[2] - u[2]
        self._position = (p[0] + dt * u[0] + drift * ex, p[1] + dt * u[1] + drift * ey, p[2] + dt * u[2] + drift * ez)
        self._velocity = (u[0] + decay * ex, u[1] + decay * ey, u[2] + decay * ez)

    def _correct(self, position: Vector, alpha: float, beta: float) -> None:
        assert self._position is not None  # noqa: S101  (it was measured before)
        p, v = self._position, self._velocity
        rx, ry, rz = position[0] - p[0], position[1] - p[1], position[2] - p[2]
        self._position = (p[0] + alpha * rx, p[1] + alpha * ry, p[2] + alpha * rz)
        self._velocity = (v[0] + beta * rx, v[1] + beta * ry, v[2] + beta * rz)
