"""Examines the body that the tracker reports for a flying drone: it must be where, and move as, the drone can.

The tracker alone measures positions, but an airframe bounds them. A pose that the drone cannot have is not used. The
body is the drone's no more, until the drone stands on the ground, if it has no other poses for `OUTLIER`, if its poses
repeat bit for bit though the drone moved or is commanded to, or if it moves apart from the commands
(control/airframe/motion_residual.py).
"""

from __future__ import annotations

from math import acos, cos, degrees
from typing import Final

from flockwire_core.control.airframe.motion_residual import GAIN_ERROR, MotionResidual
from flockwire_core.control.airframe.state import AirframeState
from flockwire_core.control.barrier import nearest_on_segment
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.pose import Pose, Quaternion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, norm, subtract
from flockwire_core.parameters import PilotParameters
from flockwire_core.pilot.phases import IN_FLIGHT
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import APART, Reason

FREE: Final = frozenset({Phase.HOLD, Phase.FORMATION})  # on the ground, and near it, a drone does not move as commanded
OUTLIER: Final = 3 * SECOND // 20  # ns: a tracker that is wrong for longer is wrong
LATE: Final = 0.25  # s, of the last command known to have come: a drone may stand though it is commanded to move
TURN, TURN_RATE = 0.5, 6.3  # rad, of a single pose, and rad/s
REPEATS: Final = "stands still, bit for bit, though it moved or is commanded to"
EXAMINE: Final = "examine tracker and airframe before the next start"


def obeys(telemetry: Telemetry, zero: float) -> bool:
    """Return whether a drone flies by its commands: its driver got one less than `zero` s ago."""
    return telemetry.state is FlightState.FLYING and telemetry.command_age <= zero


def foreign(why: str) -> Reason:
    """Return the reason of a drone whose tracked body is not its own."""
    return Reason(APART, f"the tracker's pose is not its own: it {why}", EXAMINE)


def turned(before: Quaternion, after: Quaternion) -> float:
    """Return |q* ⊗ q'| as the cosine of half the angle between two orientations."""
    return abs(before[0] * after[0] + before[1] * after[1] + before[2] * after[2] + before[3] * after[3])


class TrackedBody:
    """The body of the drone of `parameters`; `airframe` records its commands, in s from `born` (Unix ns) on.

    Attributes:
        why: why it is not the drone's; empty while it can be.
        refused: the number of poses that were not used.
        due: when to look again, Unix ns.
        way: m, from the last position to the stopping point.
        sunk: m, how far the drone was commanded to descend since the last pose.
        last: the last pose that the drone can have.

    """

    def __init__(self, parameters: PilotParameters, airframe: AirframeState, born: int) -> None:
        limits = parameters.limits
        self.why, self.refused = "", 0
        self._drifted = False  # whether it moved apart from the commands, so that what was learned of the wind is wrong
        self.due, self.sunk, self.way = 0, 0.0, ZERO
        self.last: Pose | None = None
        self._wind = max(limits.body_drift, parameters.disturbance)
        self._residual = MotionResidual(self._wind, parameters.lag + parameters.dead_time)
        self._airframe, self._born = airframe, born
        self._zero = limits.staleness.command_zero
        self._coasting = max(self._zero, limits.staleness.pose_zero)  # s without poses until the drone is stopped
        self._heard = 0.0  # s, since when the driver has got the commands without a gap
        self._refused_at = 0  # stamp of the first pose in a row that was not used, Unix ns
        self._apart = 0  # looks in a row
        self._examined = (0, 0)  # what had come when it looked last: a pose's stamp, and how many were refused
        self._looked = self._climbed = 0  # when it was looked at, and when its take-off ended, Unix ns

    @property
    def seen(self) -> int:
        """The stamp of the last pose, Unix ns; 0 before the first."""
        return self.last.stamp if self.last is not None else 0

    @property
    def place(self) -> Vector | None:
        """The last position, m; None before the first."""
        return self.last.position if self.last is not None else None

    def took_off(self, now: int) -> None:
        """Record that the drone's take-off ended at `now` (Unix ns)."""
        self._climbed = now

    def take(self, pose: Pose, phase: Phase) -> bool:
        """Return whether `pose` can be the drone's, in a flight `phase`; on the ground a person may carry it."""
        last = self.last
        if last is not None and phase in IN_FLIGHT:
            why = self.why or self._contradiction(last, pose)
            if why:
                self._refused_at = self._refused_at or pose.stamp
                self.refused += 1
                if pose.stamp - self._refused_at >= OUTLIER:
                    self.why = why
                return False
        self._refused_at = 0
        self.last, self.sunk = pose, 0.0
        return True

    def _contradiction(self, last: Pose, pose: Pose) -> str:
        """Return why the drone cannot have gone from its `last` pose to `pose`; empty if it can.

            |x − X| <= 1.3 |u| min(t, t_c) + d t + 0.2 m,   angle <= 0.5 rad + 6.3 rad/s t

        X is the nearest point on the way from x_0 to y_0, its last position and stopping point, u the last command,
        t the time since and t_c that until the pilot without poses, or the driver of a frozen one, stops it. After a
        descent without poses, x_0 is any point of it.
        """
        elapsed = max(0, pose.stamp - last.stamp) / SECOND
        coasts = norm(self._airframe.last_command) * min(elapsed, self._coasting)
        x, y, z = last.position
        from_it = subtract((x, y, min(z, max(pose.position[2], z - self.sunk))), pose.position)
        beside = norm(nearest_on_segment(from_it, add(from_it, self.way)))
        # m, of a single pose, and what the stopping point does not know
        if beside > (1.0 + GAIN_ERROR) * coasts + self._wind * elapsed + 0.2:
            return f"jumped by {norm(from_it):.2f} m"
        cosine, angle = turned(last.orientation, pose.orientation), TURN + TURN_RATE * elapsed
        if angle < 3.0 and cosine < cos(0.5 * angle):
            return f"turned by {degrees(2.0 * acos(cosine)):.0f} degrees"
        return ""

    def look(self, motion: Motion | None, telemetry: Telemetry, phase: Phase, now: int) -> None:
        """Compare with the commands at `now` (Unix ns); `motion` is None without a fresh pose."""
        self._look(motion, telemetry, phase, now)
        if self._drifted:
            self._airframe.reset()  # it is what the false body seemed to drift

    def _look(self, motion: Motion | None, telemetry: Telemetry, phase: Phase, now: int) -> None:
        gap, self._looked, self.due = now - self._looked, now, now + SECOND // 10  # ns between two looks
        if phase not in IN_FLIGHT:
            self.why, self._drifted = "", False
        # ns between two looks after which the residual starts again
        examined = phase in IN_FLIGHT and not self.why and 0 < gap <= SECOND // 2
        # s, of telemetry whose height is compared
        if not examined or motion is None or now - telemetry.stamp > 0.3 * SECOND:
            self._residual.reset()
            self._residual.forget_heights()
            self._apart = 0
            return
        came = (self.seen, self.refused)
        if came == self._examined:  # without a new pose nothing repeats, and nothing moves
            return
        self._examined = came
        why = self._apart_by(motion, telemetry, phase, now)
        self._apart = self._apart + 1 if why else 0
        if self._apart >= 3:  # looks in a row at a body that moves apart
            self.why, self._drifted = why, True

    def _apart_by(self, motion: Motion, telemetry: Telemetry, phase: Phase, now: int) -> str:
        """Return how the body moves apart from the airframe; "" if it does not."""
        since, residual, why = (now - self._born) / SECOND, self._residual, ""
        behind = abs(self.last.stamp - telemetry.stamp) / SECOND if self.last is not None else 0.0
        if rose := residual.rise(motion, telemetry.height, behind, since):
            why = f"moves by {rose:.1f} m in height, which the airframe does not"
        # ns after a take-off: one that takes off by itself obeys after its reply
        if telemetry.command_age + (now - telemetry.stamp) / SECOND > LATE:
            self._heard = since
        if phase not in FREE or not obeys(telemetry, self._zero) or now - self._climbed <= 2 * SECOND:
            residual.reset()
        else:
            residual.update(motion, self._airframe.travelled(since), since)
            if residual.repeats(self._heard):
                self.why = REPEATS
            if speed := residual.apart():
                why = f"moves {speed:.1f} m/s apart from its commands"
        return why
