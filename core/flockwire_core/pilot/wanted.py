"""The velocity that a drone is to fly, before the safety filter: by its law, or by its place outside the formation."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp
from typing import Final

from flockwire_core.control.free_place import landing_place
from flockwire_core.control.potential import repulsion
from flockwire_core.domain.body import Body
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, add, limit, scale
from flockwire_core.law import Information, Output
from flockwire_core.parameters import PilotParameters
from flockwire_core.wire.information import keeps_height
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Reason

HOLDING_GAIN = 1.5  # 1/s, of the position loop

CROWDED: Final = Reason("no landing place", "finds no free place to land on")


def keep_place(position: Vector, place: Vector, speed: float) -> Vector:
    """Return the velocity, m/s, at most `speed`, that brings `position` to `place` (m, world frame) and keeps it."""
    return limit(
        (
            HOLDING_GAIN * (place[0] - position[0]),
            HOLDING_GAIN * (place[1] - position[1]),
            HOLDING_GAIN * (place[2] - position[2]),
        ),
        speed,
    )


def climb(position: Vector, place: Vector, vertical_speed: float) -> Vector:
    """Return the velocity, m/s, of a vertical climb (descent: negative `vertical_speed`) above `place`."""
    x, y, _ = keep_place(position, (place[0], place[1], position[2]), abs(vertical_speed))
    return (x, y, vertical_speed)


class Place:
    """The place of the drone of `parameters`: its position at the first call, until it is reset."""

    def __init__(self, parameters: PilotParameters) -> None:
        self._parameters, self._rise = parameters, parameters.limits.vertical_speed
        self._place: Vector | None = None
        self.crowded = False  # it lands, and there is no free place

    def forget(self) -> None:
        """Reset: the next position becomes the place."""
        self._place, self.crowded = None, False

    def is_high(self, position: Vector) -> bool:
        """Return whether `position` (m, world frame) is at take-off height above the place."""
        place, rise = self._place, 0.95 * self._parameters.limits.takeoff_height  # of it, at which a take-off ends
        return place is not None and position[2] >= place[2] + rise

    def velocity(self, phase: Phase, position: Vector, bodies: Sequence[Body]) -> Vector:
        """Return the velocity, m/s, in a flight `phase` other than formation; `bodies` are nearby."""
        self._place = place = self._place or position
        if phase is Phase.LANDING:
            return self._descend(position, place, bodies)
        if phase is Phase.TAKEOFF:
            return climb(position, place, self._rise)
        wanted, parameters = keep_place(position, place, self._rise), self._parameters
        if parameters.filtered:
            return wanted
        return add(wanted, scale(repulsion(bodies, parameters.potentials), -parameters.formation_gain))

    def _descend(self, position: Vector, place: Vector, bodies: Sequence[Body]) -> Vector:
        """Return the velocity of a landing on `place` or, with the safety filter, first towards a free place."""
        rise, free, parameters = self._rise, True, self._parameters
        if parameters.filtered:
            place, free = landing_place(position, place, bodies, parameters.guard.separation, parameters.guard.room)
            self._place, self.crowded = place, not free
        return climb(position, place, -rise) if free else keep_place(position, (*place[:2], position[2]), rise)


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

    def __init__(self, declared: Information, parameters: PilotParameters, has_acceleration: bool) -> None:
        accelerates, lag = declared.output is Output.ACCELERATION, 0.0 if has_acceleration else parameters.lag
        self._accelerations = AccelerationInput(lag, parameters.guard.period) if accelerates else None
        self._levels = not keeps_height(declared)
        self._rise = parameters.limits.vertical_speed
        self._height: float | None = None  # m, that is held

    def velocity(
        self, wanted: Vector, sent: Vector, dt: float, motion: Motion | None, in_formation: bool, is_late: bool
    ) -> Vector:
        """Return the law's command `wanted`, m/s or m/s^2, as a velocity, m/s; rest if the law `is_late`.

        `sent` (m/s) was the command for the last `dt` s.
        """
        if self._accelerations is not None:
            self._accelerations.follow(sent, dt)
            wanted = ZERO if is_late else self._accelerations.velocity(wanted)
        if not self._levels or motion is None:
            return wanted
        if not in_formation or self._height is None:
            self._height = motion.position[2]
        above = (wanted[0], wanted[1], self._height)
        rise = keep_place((wanted[0], wanted[1], motion.position[2]), above, self._rise)[2]
        return (wanted[0], wanted[1], rise)
