"""A law's command as a velocity of the airframe, also that of a law that commands accelerations."""

from __future__ import annotations

from math import exp

from flockwire_core.domain.vector import ZERO, Vector, add, scale
from flockwire_core.law import Information, Output
from flockwire_core.parameters import PilotParameters
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.pilot.place import keep_place
from flockwire_core.wire.information import keeps_height


class AccelerationInput:
    """Turns accelerations u into velocity commands, one each `period` T (s), of an airframe with lag tau (s).

        command = w + u T / (1 − e^(−T/tau)),    w <- w + (sent − w) (1 − e^(−dt/tau))        (ours)

    w is the velocity that the airframe has reached by the commands sent, after dt s of the last one; so its lag drops
    out, and where a filter changes a command w follows what the body can reach. tau = 0: w + u T, w <- sent.
    """

    def __init__(self, lag: float, period: float) -> None:
        self._lag, self._period = lag, period
        self._reached: Vector = ZERO  # w, m/s

    def follow(self, sent: Vector, dt: float) -> None:
        """Take into account that `sent` (m/s) was the command for the last `dt` s."""
        share = self._share(dt)
        x, y, z = self._reached
        self._reached = (x + share * (sent[0] - x), y + share * (sent[1] - y), z + share * (sent[2] - z))

    def velocity(self, acceleration: Vector) -> Vector:
        """Return the velocity command, m/s, that gives `acceleration` (m/s^2) during the next period."""
        gain = self._period / self._share(self._period)
        return add(self._reached, scale(acceleration, gain))

    def _share(self, dt: float) -> float:
        return 1.0 - exp(-dt / self._lag) if self._lag > 0.0 else 1.0


class LawCommand:
    """Converts what a law of the information `declared` commands; the pilot holds the height if the law does not.

    An airframe that is told how its velocity changes (`has_acceleration`) has no lag to compensate.
    """

    def __init__(self, declared: Information, parameters: PilotParameters, has_acceleration: bool = False) -> None:
        accelerates, lag = declared.output is Output.ACCELERATION, 0.0 if has_acceleration else parameters.lag
        self._accelerations = AccelerationInput(lag, parameters.guard.period) if accelerates else None
        self._levels = not keeps_height(declared)
        self._rise = parameters.limits.vertical_speed
        self._height: float | None = None  # m, that is held

    def velocity(self, wanted: Vector, pilot: Pilot, in_formation: bool, is_late: bool) -> Vector:
        """Return the law's command, m/s or m/s^2, as a velocity, m/s; rest if the law `is_late`."""
        if self._accelerations is not None:
            self._accelerations.follow(pilot.sent, pilot.dt)
            wanted = ZERO if is_late else self._accelerations.velocity(wanted)
        motion = pilot.motion
        if not self._levels or motion is None:
            return wanted
        if not in_formation or self._height is None:
            self._height = motion.position[2]
        above = (wanted[0], wanted[1], self._height)
        rise = keep_place((wanted[0], wanted[1], motion.position[2]), above, self._rise)[2]
        return (wanted[0], wanted[1], rise)
