"""The place of a drone outside the formation, for hold, take-off and landing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from flockwire_core.control.free_place import landing_place
from flockwire_core.control.potential import repulsion
from flockwire_core.domain.body import Body
from flockwire_core.domain.vector import Vector, add, limit, scale
from flockwire_core.parameters import PilotParameters
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
