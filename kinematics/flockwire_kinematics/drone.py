"""One simulated drone: its airframe and the driver's rungs of the staleness ladder.

The driver overrides the agent. Without commands it hovers, then lands; it flies no faster than the swarm's limit,
whatever its agent commands; when the process is to end, it lands what its pilot has not landed. As with any driver a
landing that it began is not taken back, and nobody who still commands to climb takes off again after it.
"""

from __future__ import annotations

from collections.abc import Callable

from flockwire.domain.airframe import FlightState, Telemetry
from flockwire.domain.vector import ZERO, Vector, limit, norm
from flockwire.pilot.phases import age
from flockwire.process.driving import FROZEN, TOLERANCE
from flockwire.swarm.model import Swarm
from flockwire.swarm.tables import Limits

from flockwire_kinematics.airframe import FirstOrderAirframe

LEVEL = (0.0, 0.0, 0.0, 1.0)


class SimulatedDrone:
    """Driver and airframe of one drone."""

    def __init__(self, airframe: FirstOrderAirframe, limits: Limits) -> None:
        self.airframe = airframe
        self.land_at: int | None = None  # when it lands by itself, Unix ns
        self.clipped = 0  # commands that were too fast
        self._zero, self._land = limits.staleness.command_zero, limits.staleness.command_land
        self._speed, self._sink = limits.speed, limits.vertical_speed
        self._commanded = self._advanced = self._resumed = 0
        self._set_down = False  # it lands, or has landed, by itself; until its pilot, on the ground, stops climbing

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""
        state = self.airframe.state
        return state in (FlightState.FLYING, FlightState.LANDING) or self.airframe.falling

    def command(self, velocity: Vector, now: int) -> None:
        """Pass the agent's command on, no faster than the limit; not while the driver lands it by itself."""
        if self.land_at is not None and now >= self.land_at:
            return
        self._commanded = now
        if norm(velocity) > TOLERANCE * self._speed:
            self.clipped += 1
            velocity = limit(velocity, self._speed)
        if self._set_down:
            if self.airframe.state is FlightState.LANDING or velocity[2] > 0.0:
                return
            self._set_down = False
        self.airframe.command(velocity, now)

    def advance(self, now: int) -> None:
        """Move on to `now`; hover or land when the agent has been silent for too long."""
        if now - self._advanced > FROZEN:
            if self._advanced:
                self.airframe.skip(now - self._advanced)
            self._resumed = now
        self._advanced = now
        retired = self.land_at is not None and now >= self.land_at
        silent = age(self._commanded, now) > self._zero
        if (silent or retired or self._set_down) and self.airframe.state in (FlightState.FLYING, FlightState.LANDING):
            # In a pause of the process nobody could be heard: its agent has as long again.
            if retired or age(max(self._commanded, self._resumed), now) > self._land:
                self._set_down = True
                self.airframe.state = FlightState.LANDING
            self.airframe.command((0.0, 0.0, -self._sink) if self._set_down else ZERO, now)
        self.airframe.advance(now)

    @property
    def position(self) -> Vector:
        """Where it is, m, world frame."""
        return self.airframe.position

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """How it is turned, a quaternion (x, y, z, w): it never turns."""
        return LEVEL

    def stop(self) -> None:
        """Motors off, for good: in flight it falls."""
        self.airframe.stop()

    def respond(self, lag: float, dead_time: float) -> None:
        """Answer from now on with this lag and this dead time, s."""
        self.airframe.respond(lag, dead_time)

    def telemetry(self, now: int, frame: str) -> Telemetry:
        """Return how it is, in the world frame `frame`."""
        silence = age(self._commanded, now) if self._commanded else -1.0
        state = self.airframe.state
        stopped = state is FlightState.STOPPED
        return Telemetry(now, frame, state, self.airframe.battery, self.airframe.height, silence, stopped)


def standing(swarm: Swarm, number: int, now: int, _: Callable[[], float]) -> SimulatedDrone:
    """Return drone `number` of `swarm`, which stands at its start; nothing is random of it."""
    start = swarm.drone(number).start
    airframe = FirstOrderAirframe(swarm.airframe(number), start, now, swarm.ground, standing=True)
    return SimulatedDrone(airframe, swarm.limits)
