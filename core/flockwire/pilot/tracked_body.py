"""Watches whether the body that the tracker reports for a drone can be the drone.

With `limits.body_drift` it must always move as the drone is commanded. After a time without poses, or a start in
flight, names may have been exchanged, and nobody else may know it: then it must be where the drone can be, and for a
while move as the drone does, within wider limits.
"""

from __future__ import annotations

from typing import Final

from flockwire.control.airframe.disturbance import DisturbedAirframe
from flockwire.control.airframe.motion_residual import MotionResidual
from flockwire.control.airframe.response import Response
from flockwire.control.airframe.state import AirframeState
from flockwire.domain.airframe import FlightState, Telemetry
from flockwire.domain.motion import Motion
from flockwire.domain.pose import Pose
from flockwire.domain.time import SECOND
from flockwire.domain.vector import distance, norm
from flockwire.parameters import PilotParameters
from flockwire.pilot.phases import IN_FLIGHT
from flockwire.wire.phase import Phase
from flockwire.wire.status import APART, Reason

PERIOD: Final = SECOND // 10  # ns between two looks
LONGEST_GAP = SECOND // 2  # ns between two looks after which the residual starts again
FREE = frozenset({Phase.HOLD, Phase.FORMATION})  # on the ground, and near it, a drone does not move as commanded
WRONG = Reason(APART, "the tracker or the airframe is wrong", "examine both before the next start")
JUMP = 2.0  # times limits.speed: faster is a jump, which the gateway judges
ABSENCE: Final = 3 * SECOND // 10  # ns without a pose after which the body is examined: no gateway restarts so fast
OBEYS_AFTER = 2 * SECOND  # ns after a take-off: one that takes off by itself obeys after its reply
ENOUGH = 5.0  # m of commanded path after which an examined body is the drone's
WIND = 1.5  # m/s of drift of a drone without poses, or control.disturbance
NOISE = 0.2  # m


def obeys(telemetry: Telemetry | None, zero: float) -> bool:
    """Return whether a drone flies by its commands: its driver got one less than `zero` s ago."""
    return telemetry is not None and telemetry.state is FlightState.FLYING and telemetry.command_age <= zero


class TrackedBody:
    """The body of the drone of `parameters`, flown with commands that `airframe` records.

    Attributes:
        apart: m/s, its speed apart from the commands; 0 while it moves as commanded.
        watched: whether to look at it.
        due: when to look again, Unix ns.
        seen: its motion at the last pose that the pilot used, whose stamp is `seen_at`, Unix ns.
        sunk: m, how far it was commanded to descend since.

    """

    def __init__(self, parameters: PilotParameters, airframe: AirframeState | DisturbedAirframe) -> None:
        limits, guard = parameters.limits, parameters.guard
        always = guard is not None and limits.body_drift > 0.0
        self.apart, self.watched, self.due = 0.0, always, 0
        self.seen: Motion | None = None
        self.seen_at, self.sunk = 0, 0.0
        self._residual = MotionResidual(limits.body_drift, JUMP * limits.speed) if always else None
        self._speed, self._wind = limits.speed if guard is None else guard.fastest, parameters.disturbance
        self._response: Response | None = None  # while it is examined
        self._airframe, self._zero = airframe, limits.staleness.command_zero
        self._looked = self._climbed = 0  # when it was looked at, and when its take-off ended, Unix ns

    def took_off(self, now: int) -> None:
        """Record that the drone's take-off ended at `now` (Unix ns)."""
        self._climbed = now

    def examine(self) -> None:
        """Examine whether it is another drone's, from now on."""
        self.watched, self._response = True, Response(self._speed, self._wind)

    def reaches(self, pose: Pose, absence: int) -> bool:
        """Return whether the drone can be at `pose`, the first after an `absence` (ns); examine it if so.

            |x − x_0| <= |y_0 − x_0| + |u| command_zero + (1.5 m/s) t + 0.2 m

        x_0 and y_0 are its last position and stopping point, u the last command and t the time since: without poses the
        pilot commands zero, and a frozen pilot's driver does. After a descent without poses, x_0 is any point of it.
        """
        seen = self.seen
        if seen is not None:
            absence = max(absence, pose.stamp - self.seen_at)
            stops = distance(seen.position, seen.stopping) + self._zero * norm(self._airframe.last_command)
            x, y, z = seen.position
            way = (x, y, min(z, max(pose.position[2], z - self.sunk)))
            if distance(way, pose.position) > stops + max(WIND, self._wind) * absence / SECOND + NOISE:
                return False
        self.examine()
        return True

    def look(self, motion: Motion | None, telemetry: Telemetry | None, phase: Phase, now: int, born: int) -> None:
        """Compare at `now` (Unix ns); the airframe's times count from `born`. A drone that is apart lands."""
        gap, self._looked, self.due = now - self._looked, now, now + PERIOD
        residual, response = self._residual, self._response
        if phase not in IN_FLIGHT:
            self.apart, self._response, self.watched = 0.0, None, residual is not None
        self._climbed = min(self._climbed, now)  # a clock may be set back
        looked = 0 < gap <= LONGEST_GAP
        if motion is None or telemetry is None or phase not in FREE or not (looked and obeys(telemetry, self._zero)):
            if residual is not None:
                residual.reset()
            if response is not None:
                response.reset()
            return
        since = (now - born) / SECOND
        travelled = self._airframe.travelled(since)
        if residual is not None and residual.update(motion.stopping, travelled, since):
            self.apart = residual.speed
        if response is not None and now - telemetry.stamp > LONGEST_GAP:
            response.reset()  # neither its height nor whether it obeys is known
        elif response is not None and now - self._climbed > OBEYS_AFTER:
            floor = motion.position[2] - telemetry.height
            self._judge(response, response.update(motion.stopping, travelled, floor, since))

    def _judge(self, response: Response, apart: float) -> None:
        """Land a body that is `apart`, m/s; end the examination of one that moved as commanded for long enough."""
        if apart:
            self.apart = apart
        elif response.path >= ENOUGH and not self.apart:
            self._response, self.watched = None, self._residual is not None
