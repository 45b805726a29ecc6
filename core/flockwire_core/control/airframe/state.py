"""The state of an airframe with lag and dead time: its velocity and its stopping point."""

from __future__ import annotations

from collections import deque
from math import exp
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import ZERO, Vector


@mypyc_attr(acyclic=True)
class Given(Record):
    """A command, m/s, given at `begin`, s, when the integral of all before it was `travelled`, m."""

    __slots__ = ("begin", "velocity", "travelled")

    def __init__(self, begin: float, velocity: Vector, travelled: Vector) -> None:
        self.begin: Final = begin
        self.velocity: Final = velocity
        self.travelled: Final = travelled


WHOLE, LEVEL, VERTICAL = (1.0, 1.0, 1.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)  # axes whose disturbance is learned


class AirframeState:
    """Follows one airframe by its model and its measured positions; times in s on one clock.

        lag v' + v = u(t − D),   x' = v

    The stopping point y = x + lag v + ∫_{s−D}^{now} u (x, v at the time s of the pose) obeys y' = u(now) exactly: for
    any lag and dead time, the commands drive it without delay. The airframe's path from x to y is a chain of convex
    combinations of x, x + lag v and the commands under way.

    It knows no disturbance: a DisturbedAirframe (disturbance.py) estimates and compensates one.
    """

    def __init__(self, lag: float, dead_time: float, time_constant: float = 0.1) -> None:
        self.disturbance: Vector = ZERO  # m/s
        self.last_command: Vector = ZERO  # m/s, the newest velocity to fly
        self._lag, self._dead_time, self._time_constant = lag, dead_time, time_constant
        self._commands: deque[Given] = deque()
        self._position: Vector | None = None
        self._velocity = ZERO
        self._stamp = 0.0

    def command(self, velocity: Vector, now: float) -> Vector:
        """Return the command that flies `velocity`, m/s, from `now` on, and record it."""
        commands = self._commands
        commands.append(Given(now, velocity, self.travelled(now)))
        # s of commands, beyond the dead time: more than the age of any used pose
        while commands[0].begin < now - self._dead_time - 5.0:
            commands.popleft()
        self.last_command = velocity
        return velocity

    def measure(self, position: Vector, stamp: float, now: float, learns: Vector | None = WHOLE) -> Motion:
        """Receive the newest `position` (m), measured at `stamp`; return the motion at `now`, before the next command.

        `learns` is 1 for each axis whose disturbance may be learned, 0 for one that is kept; None: all are.
        """
        dt = stamp - self._stamp
        if self._position is None or dt > 1.0:  # s between two poses after which the old velocity is dropped
            self._position, self._velocity, self._stamp = position, ZERO, stamp
        elif dt > 0.0:
            q = exp(-dt / self._time_constant)
            there, velocity = self._predict(self._position, stamp)
            self._position, self._velocity = _corrected(there, velocity, position, 1.0 - q * q, (1.0 - q) ** 2 / dt)
            self._stamp = stamp
        lag, v = self._lag, self._velocity
        x1, y1, z1 = self.travelled(now)
        x0, y0, z0 = self.travelled(self._stamp - self._dead_time)
        stopping = (
            position[0] + lag * v[0] + x1 - x0,
            position[1] + lag * v[1] + y1 - y0,
            position[2] + lag * v[2] + z1 - z0,
        )
        return Motion(position, v, stopping)

    def travelled(self, when: float) -> Vector:
        """Return the integral of the commands up to `when`, m."""
        for given in reversed(self._commands):
            if given.begin <= when:
                dt, u, x = when - given.begin, given.velocity, given.travelled
                return (x[0] + dt * u[0], x[1] + dt * u[1], x[2] + dt * u[2])
        return self._commands[0].travelled if self._commands else ZERO

    def reset(self) -> None:
        """Forget the disturbance: the airframe does not fly."""

    def limit_vertical(self, most: float) -> None:
        """Limit the vertical part of the disturbance to `most`, m/s."""

    def speed(self, most: float) -> float:
        """Return the speed, m/s, that keeps every command within `most`."""
        return most

    def _predict(self, position: Vector, stamp: float) -> tuple[Vector, Vector]:
        """Integrate the model from the last measurement, at `position`, to `stamp`; return position and velocity."""
        commands, at, velocity = self._commands, self._stamp, self._velocity
        while len(commands) > 1 and commands[1].begin + self._dead_time <= at:
            commands.popleft()
        current = ZERO
        for given in commands:
            effective = given.begin + self._dead_time
            if effective >= stamp:
                break
            if effective > at:
                position, velocity = _flown(position, velocity, current, effective - at, self._lag)
                at = effective
            current = given.velocity
        return _flown(position, velocity, current, stamp - at, self._lag)


def _flown(p: Vector, v: Vector, u: Vector, dt: float, lag: float) -> tuple[Vector, Vector]:
    """Return position and velocity after `dt` s under the input u."""
    decay = exp(-dt / lag) if lag else 0.0
    drift = lag * (1.0 - decay)
    px, py, pz = p
    ux, uy, uz = u
    ex, ey, ez = v[0] - ux, v[1] - uy, v[2] - uz
    return (
        (px + dt * ux + drift * ex, py + dt * uy + drift * ey, pz + dt * uz + drift * ez),
        (ux + decay * ex, uy + decay * ey, uz + decay * ez),
    )


def _corrected(p: Vector, v: Vector, measured: Vector, alpha: float, beta: float) -> tuple[Vector, Vector]:
    """Return position and velocity after one step of an alpha-beta filter."""
    px, py, pz = p
    vx, vy, vz = v
    rx, ry, rz = measured[0] - px, measured[1] - py, measured[2] - pz
    return (px + alpha * rx, py + alpha * ry, pz + alpha * rz), (vx + beta * rx, vy + beta * ry, vz + beta * rz)
