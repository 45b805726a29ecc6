"""A law's command as a velocity of the airframe."""

from __future__ import annotations

from flockwire_core.control.airframe.acceleration import AccelerationInput
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.law import Information, Output, Sense
from flockwire_core.parameters import PilotParameters
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.pilot.place import keep_place


class LawCommand:
    """Converts what a law of the information `declared` commands; the pilot holds the height if the law does not.

    An airframe that is told how its velocity changes (`has_acceleration`) has no lag to compensate.
    """

    def __init__(self, declared: Information, parameters: PilotParameters, has_acceleration: bool = False) -> None:
        accelerates, lag = declared.output is Output.ACCELERATION, 0.0 if has_acceleration else parameters.lag
        self._accelerations = AccelerationInput(lag, parameters.period) if accelerates else None
        self._levels = declared.planar or not declared.own & Sense.POSITION
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
