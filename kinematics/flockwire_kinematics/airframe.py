"""A simulated airframe: it answers a velocity command with a first-order lag behind a dead time.

    lag v' + v = gain u(t - dead_time),   x' = v        (lag = 0: v = gain u; then (2) of the paper, x' = u)

Both are solved exactly between two moments at which the command changes, so the answer does not depend on how often
the state is looked at.
"""

from __future__ import annotations

from collections import deque

from flockwire.control.first_order_lag import lagged_motion
from flockwire.domain.time import SECOND
from flockwire.domain.vector import ZERO, Vector, add, scale
from flockwire.process.driving import CONTACT, GRAVITY
from flockwire.swarm.drones import Airframe
from flockwire.wire.messages import FlightState


class FirstOrderAirframe:
    """One airframe at `position` (m, world frame) at `now` (Unix ns).

    It flies when that is above the `ground` (m, world z), unless it is `standing` there: on a table, say, which is gone
    once it has taken off.
    """

    def __init__(
        self, parameters: Airframe, position: Vector, now: int, ground: float = 0.0, standing: bool = False
    ) -> None:
        self.position, self.velocity = position, ZERO
        self._ground = ground
        airborne = self.height > CONTACT and not standing
        self.state = FlightState.FLYING if airborne else FlightState.GROUNDED
        self.battery = 1.0
        self._parameters = parameters
        self._now = now
        self._input = ZERO
        self._coming: deque[tuple[int, Vector]] = deque()  # when it takes effect, command

    def command(self, velocity: Vector, now: int) -> None:
        """Command a velocity, m/s, world frame, at `now`; a command to rise takes off."""
        self._coming.append((now + round(self._parameters.dead_time * SECOND), velocity))
        if self.state is FlightState.GROUNDED and velocity[2] > 0.0:
            self.state = FlightState.FLYING

    def respond(self, lag: float, dead_time: float) -> None:
        """Answer from now on with this lag and this dead time, s."""
        self._parameters = self._parameters.model_copy(update={"lag": lag, "dead_time": dead_time})

    def stop(self) -> None:
        """Motors off, for good: in flight it falls."""
        self.state = FlightState.STOPPED

    @property
    def falling(self) -> bool:
        """Whether it is above the ground with its motors off."""
        return self.state is FlightState.STOPPED and self.height > CONTACT

    @property
    def height(self) -> float:
        """Height above the ground, m."""
        return self.position[2] - self._ground

    def skip(self, pause: int) -> None:
        """Stand still for `pause` ns, during which nobody simulated it; what was commanded before is not flown."""
        self._now += pause
        self._coming.clear()
        self._input = ZERO

    def advance(self, now: int) -> None:
        """Move on to `now` (Unix ns)."""
        while self._coming and self._coming[0][0] <= now:
            moment, velocity = self._coming.popleft()
            if moment > self._now:
                self._move((moment - self._now) / SECOND)
                self._now = moment
            self._input = scale(velocity, self._parameters.gain)
        if now > self._now:
            self._move((now - self._now) / SECOND)
            self._now = now

    def _move(self, dt: float) -> None:
        """Fly, fall or stand for `dt` s under the present input."""
        if self.state is FlightState.GROUNDED:
            return
        if self.state is FlightState.STOPPED:
            x, y, z = self.velocity
            self.position = add(self.position, (x * dt, y * dt, z * dt - GRAVITY * dt * dt / 2.0))
            self.velocity = (x, y, z - GRAVITY * dt)
        else:
            parameters, battery = self._parameters, self.battery
            self.position, self.velocity = lagged_motion(self.position, self.velocity, self._input, parameters.lag, dt)
            battery -= dt / parameters.endurance
            self.battery = battery if battery > 0.0 else 0.0
        if self.velocity[2] < 0.0 and self.position[2] - self._ground <= CONTACT:
            self.position, self.velocity = (self.position[0], self.position[1], self._ground), ZERO
            if self.state is not FlightState.STOPPED:
                self.state = FlightState.GROUNDED
