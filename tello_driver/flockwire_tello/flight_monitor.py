"""What a Tello's state strings tell of its flight: no reply to a command is believed without them."""

from __future__ import annotations

from flockwire.nanoseconds import BILLION

from flockwire_tello.state_string import TelloState

SILENT = BILLION  # ns without a state after which nothing is known
OFF_THE_GROUND = 20  # cm: the height is given in steps of 10
CLEAR_BELOW, FARTHEST_TOF = 30, 800  # cm: from 30 on the time-of-flight sensor sees the ground far away
TILT = 10  # degrees that one on the ground may stand tilted
MOTORS_STAND = 16 * BILLION // 10  # ns that the motors' time, in whole seconds, does not go on


class FlightMonitor:
    """Judges the states of one Tello. Times are ns of one clock that does not go back."""

    def __init__(self) -> None:
        self.state: TelloState | None = None
        self._at = self._ran_at = -SILENT - MOTORS_STAND

    def update(self, state: TelloState, at: int) -> None:
        """Take in the newest state, which came at `at`."""
        before = self.state.time if self.state is not None else None
        if before is not None and state.time is not None and state.time > before:
            self._ran_at = at
        self.state, self._at = state, at

    def silence(self, now: int) -> int:
        """Return for how long no state has come, ns; large before the first."""
        return now - self._at

    def heard(self, now: int) -> bool:
        """Return whether a state came lately."""
        return self.silence(now) < SILENT

    def motors(self, now: int) -> bool:
        """Return whether the motors are known to run."""
        return now - self._ran_at < MOTORS_STAND

    def airborne(self, now: int) -> bool:
        """Return whether the newest state shows it off the ground, or its motors run."""
        state = self.state
        if state is None:
            return False
        return state.h >= OFF_THE_GROUND or CLEAR_BELOW <= state.tof <= FARTHEST_TOF or self.motors(now)

    def imu_trouble(self, now: int) -> str:
        """Return what is wrong with a drone that stands, with a remedy; empty when nothing is, or it cannot be told."""
        state = self.state
        if state is None or self.airborne(now):
            return ""
        if state.agz is not None and not any((state.agx, state.agy, state.agz)):
            return "IMU gives nothing: switch it off and on; else calibrate it in the maker's app"
        tilt = max(abs(state.pitch), abs(state.roll))
        return (
            f"IMU shows a tilt of {tilt} degrees: put it level; else calibrate it in the maker's app"
            if tilt > TILT
            else ""
        )

    @property
    def height(self) -> float:
        """Height above the take-off point by the newest state, m."""
        return self.state.h / 100.0 if self.state is not None else 0.0

    @property
    def battery(self) -> float:
        """Battery by the newest state, share of full."""
        return max(0.0, min(1.0, self.state.bat / 100.0)) if self.state is not None else 0.0
