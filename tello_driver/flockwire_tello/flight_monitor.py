"""Judges a Tello's flight by its state strings, in a time that does not jump: a reply to a command is not proof."""

from __future__ import annotations

from flockwire_core.domain.time import SECOND
from flockwire_core.wire.status import Reason

from flockwire_tello.state_string import TelloState

SILENT = SECOND  # ns without a state after which its flight is unknown
CLEAR_BELOW, FARTHEST_TOF = 30, 800  # cm: from 30 on the time-of-flight sensor shows a distance to the ground
HELD = 3 * SECOND  # ns of states without an advance, some of which may be lost
MOTORS_STAND = 16 * SECOND // 10  # ns that the motors' time, in whole seconds, does not advance


class FlightMonitor:
    """Judges the states of one Tello. Times are ns of one clock that does not go back."""

    def __init__(self) -> None:
        self.state: TelloState | None = None
        self._at = self._ran_at = self._seen_from = -SILENT - MOTORS_STAND

    def update(self, state: TelloState, at: int) -> None:
        """Receive the newest state, which came at `at`."""
        before = self.state.time if self.state is not None else None
        if before is not None and state.time is not None and state.time > before:
            self._ran_at = at
        if at - self._at >= SILENT:
            self._seen_from = at
        self.state, self._at = state, at

    def silence(self, now: int) -> int:
        """Return the time since the last state, ns; large before the first."""
        return now - self._at

    def heard(self, now: int) -> bool:
        """Return whether a state arrived lately."""
        return self.silence(now) < SILENT

    @property
    def off_the_ground(self) -> bool:
        """Whether the newest state shows it off the ground."""
        state = self.state
        # cm: the height is given in steps of 10
        return state is not None and (state.h >= 20 or CLEAR_BELOW <= state.tof <= FARTHEST_TOF)

    def airborne(self, now: int) -> bool:
        """Return whether the newest state shows it off the ground, or its motors are known to run."""
        return self.off_the_ground or now - self._ran_at < MOTORS_STAND

    def down(self, now: int) -> bool:
        """Return whether it is known to be on the ground, motors stopped: their time has to be watched for a while."""
        if self.state is None or self.airborne(now):
            return False
        return not self.state.time or now - self._seen_from >= MOTORS_STAND

    def held(self, now: int) -> bool:
        """Return whether it is off the ground though its motors have stopped, or have never run."""
        state = self.state
        if state is None or state.time is None or not self.off_the_ground:
            return False
        return state.time == 0 or now - max(self._ran_at, self._seen_from) >= HELD

    def imu_trouble(self, now: int) -> Reason | None:
        """Return the problem of the IMU of a drone on the ground; None without one, or if unknown."""
        state = self.state
        if state is None or self.airborne(now):
            return None
        if state.agz is not None and not any((state.agx, state.agy, state.agz)):
            return Reason(
                "IMU", "IMU has no data", "switch it off and on; if that does not help, calibrate it in the maker's app"
            )
        if (tilt := max(abs(state.pitch), abs(state.roll))) <= 10:  # degrees, largest tilt on the ground
            return None
        remedy = "place it level; if that does not help, calibrate it in the maker's app"
        return Reason("IMU", f"IMU shows a tilt of {tilt} degrees", remedy)

    @property
    def height(self) -> float:
        """Height above the take-off point by the newest state, m."""
        return self.state.h / 100.0 if self.state is not None else 0.0

    @property
    def battery(self) -> float:
        """Battery by the newest state, share of full."""
        return max(0.0, min(1.0, self.state.bat / 100.0)) if self.state is not None else 0.0
