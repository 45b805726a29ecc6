"""One simulated drone: its airframe and the driver's rungs of the staleness ladder.

The driver overrides the agent. Without commands it hovers, then lands. It flies no faster than the swarm's limit,
whatever its agent commands. If the process must end, it lands a drone that its pilot has not landed. As with any
driver, a landing that it began is not cancelled, and a climb command that continues does not take off again.
"""

from __future__ import annotations

from collections.abc import Callable

from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.vector import ZERO, Vector, limit, norm
from flockwire_core.pilot.phases import age
from flockwire_core.process.driving import FROZEN, TOLERANCE
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.tables import Limits

from flockwire_twins.kinematics.airframe import FLYING, LANDING, FirstOrderAirframe, FlyingBody


class SimulatedDrone:
    """Driver and airframe of one drone."""

    def __init__(self, airframe: FlyingBody, limits: Limits) -> None:
        self.airframe = airframe
        self.land_at: int | None = None  # time of its own landing, Unix ns
        self.clipped = 0  # commands that were too fast
        self._zero, self._land = limits.staleness.command_zero, limits.staleness.command_land
        self._speed, self._sink = limits.speed, limits.vertical_speed
        self._commanded = self._advanced = self._resumed = 0
        self._set_down = False  # it lands, or has landed, by its own decision, until its pilot stops climbing

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""
        state = self.airframe.state
        return state is FLYING or state is LANDING or self.airframe.falling

    def command(self, velocity: Vector, now: int, yaw_rate: float = 0.0, acceleration: Vector = ZERO) -> None:
        """Pass the agent's command on, limited in speed; ignored while the driver lands the drone."""
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
        self.airframe.command(velocity, now, yaw_rate, acceleration)

    def advance(self, now: int) -> None:
        """Advance to `now`; hover or land if the agent has been silent for too long."""
        if now - self._advanced > FROZEN:
            if self._advanced:
                self.airframe.skip(now - self._advanced)
            self._resumed = now
        self._advanced = now
        retired = self.land_at is not None and now >= self.land_at
        silent = age(self._commanded, now) > self._zero
        state = self.airframe.state
        if (silent or retired or self._set_down) and (state is FLYING or state is LANDING):
            # During a pause the process received nothing: the agent's time limit restarts.
            if retired or age(max(self._commanded, self._resumed), now) > self._land:
                self._set_down = True
                self.airframe.state = FlightState.LANDING
            self.airframe.command((0.0, 0.0, -self._sink) if self._set_down else ZERO, now)
        self.airframe.advance(now)

    def telemetry(self, now: int, frame: str) -> Telemetry:
        """Return its telemetry, in the world frame `frame`."""
        silence = age(self._commanded, now) if self._commanded else -1.0
        state = self.airframe.state
        stopped = state is FlightState.STOPPED
        return Telemetry(now, frame, state, self.airframe.battery, self.airframe.height, silence, stopped)


def standing(swarm: Swarm, number: int, now: int, _: Callable[[], float]) -> SimulatedDrone:
    """Return drone `number` of `swarm` at its start; it has no random values."""
    start = swarm.drone(number).start
    airframe = FirstOrderAirframe(swarm.airframe(number), start, now, swarm.ground, standing=True)
    return SimulatedDrone(airframe, swarm.limits)
