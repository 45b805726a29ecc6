"""One simulated drone: its airframe and the driver's rungs of the staleness ladder.

The driver overrides the agent. Without commands it hovers, then lands, until commands come again; it flies no faster
than the swarm's limit, whatever its agent commands; when the process is to end, it lands what its pilot has not landed.
"""

from __future__ import annotations

from flockwire.control.vector import ZERO, Vector, limit, norm
from flockwire.flight.phases import age
from flockwire.nanoseconds import BILLION
from flockwire.swarm.tables import Limits
from flockwire.wire.messages import FlightState

from flockwire_tello.airframe import SimulatedAirframe

TOLERANCE = 1.05  # share of the speed limit above which a command is clipped: the safety filter may touch the limit
STOOD_STILL = BILLION // 4  # ns: over a longer pause of the process the simulated world stood still, too


class SimulatedDrone:
    """Driver and airframe of one drone."""

    def __init__(self, airframe: SimulatedAirframe, limits: Limits) -> None:
        self.airframe = airframe
        self.land_at: int | None = None  # when it lands by itself, Unix ns
        self.clipped = 0  # commands that were too fast
        self._zero, self._land = limits.staleness.command_zero, limits.staleness.command_land
        self._speed, self._sink = limits.speed, limits.vertical_speed
        self._commanded = self._advanced = 0

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""
        state = self.airframe.state
        return state in (FlightState.FLYING, FlightState.LANDING) or self.airframe.falling

    def command(self, velocity: Vector, now: int) -> None:
        """Pass the agent's command on, no faster than the limit; not while it lands for good."""
        if self.land_at is not None and now >= self.land_at:
            return
        self._commanded = now
        if norm(velocity) > TOLERANCE * self._speed:
            self.clipped += 1
            velocity = limit(velocity, self._speed)
        if self.airframe.state is FlightState.LANDING:
            self.airframe.state = FlightState.FLYING
        self.airframe.command(velocity, now)

    def advance(self, now: int) -> None:
        """Move on to `now`; hover or land when the agent has been silent for too long."""
        if self._advanced and now - self._advanced > STOOD_STILL:
            self.airframe.skip(now - self._advanced)
        self._advanced = now
        silence = age(self._commanded, now)
        retired = self.land_at is not None and now >= self.land_at
        if (silence > self._zero or retired) and self.airframe.state in (FlightState.FLYING, FlightState.LANDING):
            landing = silence > self._land or retired
            self.airframe.command((0.0, 0.0, -self._sink) if landing else ZERO, now)
            if landing:
                self.airframe.state = FlightState.LANDING
        self.airframe.advance(now)

    def command_age(self, now: int) -> float:
        """Return the seconds since the last command, -1 before the first."""
        return age(self._commanded, now) if self._commanded else -1.0
