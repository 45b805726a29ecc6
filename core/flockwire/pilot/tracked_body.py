"""Watches whether the body that the tracker reports for a drone moves as the drone is commanded."""

from __future__ import annotations

from flockwire.control.airframe_state import AirframeState
from flockwire.control.disturbance import DisturbedAirframe
from flockwire.control.motion_residual import MotionResidual
from flockwire.domain.airframe import FlightState, Telemetry
from flockwire.domain.motion import Motion
from flockwire.domain.time import SECOND
from flockwire.pilot.phases import IN_FLIGHT
from flockwire.swarm.tables import Limits
from flockwire.wire.phase import Phase
from flockwire.wire.status import APART, Reason

PERIOD = SECOND // 10  # ns between two looks
LONGEST_GAP = SECOND // 2  # ns between two looks after which the residual starts again
FREE = frozenset({Phase.HOLD, Phase.FORMATION})  # on the ground, and near it, a drone does not move as commanded
WRONG = Reason(APART, "the tracker or the airframe is wrong", "examine both before the next start")
JUMP = 2.0  # times limits.speed: faster is a jump, which the gateway judges


class TrackedBody:
    """The body of one drone with `limits`, flown with commands that `airframe` records."""

    def __init__(self, limits: Limits, airframe: AirframeState | DisturbedAirframe) -> None:
        self.apart = 0.0  # m/s, its speed apart from the commands; 0 while it moves as commanded
        self.due = 0  # when to look again, Unix ns
        self._residual = MotionResidual(limits.body_drift, JUMP * limits.speed)
        self._airframe, self._zero = airframe, limits.staleness.command_zero
        self._looked = 0

    def look(self, motion: Motion | None, telemetry: Telemetry | None, phase: Phase, now: int, born: int) -> None:
        """Compare at `now` (Unix ns); the airframe's times count from `born`. A drone that is apart lands."""
        gap, self._looked, self.due = now - self._looked, now, now + PERIOD
        if phase not in IN_FLIGHT:
            self.apart = 0.0
        flies = telemetry is not None and telemetry.state is FlightState.FLYING
        obeys = telemetry is not None and telemetry.command_age <= self._zero
        if motion is None or phase not in FREE or not flies or not obeys or not 0 < gap <= LONGEST_GAP:
            self._residual.reset()
            return
        since = (now - born) / SECOND
        if self._residual.update(motion.stopping, self._airframe.travelled(since), since):
            self.apart = self._residual.speed
