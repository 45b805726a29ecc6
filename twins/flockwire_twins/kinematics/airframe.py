"""A simulated airframe: it responds to a velocity command with a dead time and a first-order lag.

    lag v' + v = gain u(t - dead_time) + w(t),   x' = v        (lag = 0: v = gain u + w; gain = 1, w = 0: x' = u, (2))

w is the wind, constant for a step of the wind's own. Both are solved exactly between two changes of the command or the
wind, so the motion does not depend on the rate of calls.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.pose import LEVEL
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, scale
from flockwire_core.process.driving import CONTACT, GRAVITY
from flockwire_core.swarm.drones import Airframe

from flockwire_twins.simulated_airframe import Wear
from flockwire_twins.wind import STEP, Wind

FLYING: Final = FlightState.FLYING  # compiled, a constant costs less than an attribute
GROUNDED: Final = FlightState.GROUNDED
LANDING: Final = FlightState.LANDING
STOPPED: Final = FlightState.STOPPED


class FlyingBody:
    """The common part of simulated airframes: one at `position` (m, world frame) at `now` (Unix ns).

    It flies if that is above the `ground` (m, world z), unless it is `standing` there, as on a table; the table is gone
    after take-off. `lag` and `dead_time` (s) are those of its response.
    """

    def __init__(
        self, parameters: Airframe, lag: float, dead_time: float, position: Vector, now: int, ground: float,
        standing: bool,
    ) -> None:  # fmt: skip
        self.position, self.velocity, self.orientation = position, ZERO, LEVEL
        self._ground = ground
        airborne = self.height > CONTACT and not standing
        self.state = FLYING if airborne else GROUNDED
        self.battery = 1.0
        self.failure = ""  # why it stopped its motors by itself
        self._gain, self._endurance = parameters.gain, parameters.endurance
        self._now = now
        self.respond(lag, dead_time)
        self._input, self._yaw_rate, self._change = ZERO, 0.0, ZERO
        self._coming: deque[tuple[int, Vector, float, Vector]] = deque()  # effective time, command
        self._wind: Wind | None = None  # None: calm

    def command(self, velocity: Vector, now: int, yaw_rate: float = 0.0, acceleration: Vector = ZERO) -> None:
        """Command a velocity (m/s, world frame) and a yaw rate (rad/s) at `now`; a climb command takes off.

        `acceleration` (m/s^2) is how the velocity changes; only an airframe whose row `accelerates` uses it.
        """
        self._coming.append((now + self._dead_time, velocity, yaw_rate, acceleration))
        if self.state is GROUNDED and velocity[2] > 0.0:
            self.state = FLYING

    def respond(self, lag: float, dead_time: float) -> None:
        """Set lag and dead time, s."""
        self._lag, self._dead_time = lag, round(dead_time * SECOND)

    def wear(self, wear: Wear) -> None:
        """Set what is wrong with it."""

    @property
    def remark(self) -> str:
        """What is at its limit."""
        return ""

    def blow(self, wind: Wind) -> None:
        """Set the wind."""
        self._wind = wind if wind.blows else None

    def stop(self) -> None:
        """Stop the motors permanently: in flight it falls."""
        self.state = STOPPED

    @property
    def falling(self) -> bool:
        """Whether it is above the ground with its motors off."""
        return self.state is STOPPED and self.height > CONTACT

    @property
    def height(self) -> float:
        """Height above the ground, m."""
        return self.position[2] - self._ground

    def skip(self, pause: int) -> None:
        """Freeze for `pause` ns without simulation; earlier commands are dropped."""
        self._now += pause
        self._coming.clear()
        self._input = self._change = ZERO

    def advance(self, now: int) -> None:
        """Advance to `now` (Unix ns)."""
        while self._coming and self._coming[0][0] <= now:
            moment, velocity, yaw_rate, change = self._coming.popleft()
            self._fly(moment)
            self._input, self._yaw_rate, self._change = scale(velocity, self._gain), yaw_rate, change
        self._fly(now)

    def _fly(self, until: int) -> None:
        """Fly, fall or stand until `until` (Unix ns), which may be past, with the current input."""
        raise NotImplementedError


class FirstOrderAirframe(FlyingBody):
    """An airframe with the response of `parameters`."""

    def __init__(
        self, parameters: Airframe, position: Vector, now: int, ground: float = 0.0, standing: bool = False
    ) -> None:
        super().__init__(parameters, parameters.lag, parameters.dead_time, position, now, ground, standing)

    def _fly(self, until: int) -> None:
        """Fly, fall or stand until `until` (Unix ns), which may be past, with the current input."""
        while self._now < until:
            end, velocity = until, self._input
            if self._wind is not None:
                end = min(until, self._now - self._now % STEP + STEP)
                velocity = add(velocity, self._wind.at(self._now))
            self._move((end - self._now) / SECOND, velocity)
            self._now = end

    def _move(self, dt: float, velocity: Vector) -> None:
        """Fly, fall or stand for `dt` s; in flight its velocity approaches `velocity`, m/s."""
        if self.state is GROUNDED:
            return
        if self.state is STOPPED:
            x, y, z = self.velocity
            self.position = add(self.position, (x * dt, y * dt, z * dt - GRAVITY * dt * dt / 2.0))
            self.velocity = (x, y, z - GRAVITY * dt)
        else:
            moved = lagged_motion(self.position, self.velocity, velocity, self._lag, dt)
            self.position, self.velocity = moved[0], moved[1]
            battery = self.battery - dt / self._endurance
            self.battery = battery if battery > 0.0 else 0.0
        if self.velocity[2] < 0.0 and self.position[2] - self._ground <= CONTACT:
            self._stand()

    def _stand(self) -> None:
        """Stand on the ground, which it touches."""
        self.position, self.velocity = (self.position[0], self.position[1], self._ground), ZERO
        if self.state is not STOPPED:
            self.state = GROUNDED
