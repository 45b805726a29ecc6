"""A gamepad's sticks as a velocity: the left one north, south, east, west, the right one up and down.

    v = speed · s / |s| · max(0, |s| − d) / (1 − d),    d = DEAD_ZONE, |s| at most 1

A stick that does not return exactly to its middle has no effect, and the velocity does not jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import NamedTuple

from flockwire.domain.vector import Vector, limit

DEAD_ZONE = 0.15  # share of a stick's deflection
EAST, SOUTH, THROTTLE, OTHER_THROTTLE = 0x00, 0x01, 0x04, 0x05  # ABS_X, ABS_Y, ABS_RY; pads without it have ABS_RZ


class AxisRange(NamedTuple):
    """The ends of an axis, in its own units."""

    low: int
    high: int

    def share(self, value: int) -> float:
        """Return the deflection of `value`, from -1 to 1; 0 for an axis without a range."""
        if self.high <= self.low:
            return 0.0
        return max(-1.0, min(2.0 * (value - self.low) / (self.high - self.low) - 1.0, 1.0))


class GamepadAxes:
    """Converts positions of the axes in `ranges`, by code, to a velocity of at most `speed` m/s, world frame."""

    def __init__(self, speed: float, ranges: Mapping[int, AxisRange]) -> None:
        self._speed, self._ranges = speed, ranges
        self._climb = THROTTLE if THROTTLE in ranges else OTHER_THROTTLE
        self._shares: dict[int, float] = {}

    def move(self, code: int, value: int) -> None:
        """Set the position of an axis; other axes are ignored."""
        if code in self._ranges:
            self._shares[code] = self._ranges[code].share(value)

    def rest(self) -> None:
        """Centre all sticks, because the gamepad is gone."""
        self._shares.clear()

    def velocity(self) -> Vector:
        """Return the velocity to command; sticks point away (up) at their low end."""
        east, north = self._shares.get(EAST, 0.0), -self._shares.get(SOUTH, 0.0)
        climb = -self._shares.get(self._climb, 0.0)
        level = _beyond(hypot(east, north))
        return limit(
            (self._speed * level * east, self._speed * level * north, self._speed * _beyond(abs(climb)) * climb),
            self._speed,
        )


def _beyond(deflection: float) -> float:
    """Return the factor of a stick with this deflection that removes the dead zone."""
    if deflection <= DEAD_ZONE:
        return 0.0
    return (min(deflection, 1.0) - DEAD_ZONE) / (1.0 - DEAD_ZONE) / deflection
