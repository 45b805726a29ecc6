"""Converts a world velocity to the sticks of one Tello: yaw, stick gains, rounding.

    omega = limit(K_yaw wrap(heading − yaw), rate)                            holds the heading
    n_k = round(s_k + e_k),   e_{k+1} = s_k + e_k − n_k                       carries what rounding leaves over

s is the exact stick value. The average of a few `rc` is exact, though each is a whole number: a Tello's smallest step
is about 1 cm/s.
"""

from __future__ import annotations

from flockwire_core.domain.pose import wrapped, yaw_of
from flockwire_core.domain.quaternion import Quaternion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector

from flockwire_tello.sticks import CENTRED, Sticks, stick_values, to_body
from flockwire_tello.swarm_file import StickGains

YAW_RATE = 0.6  # rad/s, at most


class StickControl:
    """Sets the sticks of one Tello by its tracked yaw, while that is newer than `maximum_age`.

    Times are ns of one clock that does not go back.
    """

    def __init__(self, gains: StickGains, maximum_age: int) -> None:
        self._gains, self._maximum_age = gains, maximum_age
        self._yaw: float | None = None  # rad, counter-clockwise from world x; None before the first pose
        self._seen = 0
        self._heading: float | None = None  # held heading, rad
        self._rest = (0.0, 0.0, 0.0, 0.0)

    def see(self, orientation: Quaternion, at: int) -> None:
        """Receive the tracked orientation (x, y, z, w), received at `at`."""
        self._yaw, self._seen = yaw_of(orientation), at

    def release(self) -> None:
        """Release the heading; the next `sticks` holds the current one."""
        self._heading = None

    def blind(self, now: int) -> bool:
        """Return whether the heading is unknown: no pose yet, or none for too long."""
        return self._yaw is None or now - self._seen >= self._maximum_age

    def sticks(self, velocity: Vector, yaw_rate: float, now: int) -> Sticks:
        """Return the sticks for a world velocity (m/s) and a yaw rate (rad/s, ccw); 0 holds the heading.

        While it is blind, only up and down are used: with a wrong yaw, corrections would be errors.
        """
        yaw = self._yaw
        if yaw is None or self.blind(now):
            return self._whole((0.0, 0.0, velocity[2]), 0.0)
        if yaw_rate or self._heading is None:
            self._heading = yaw
        elif now - self._seen < SECOND // 2:  # ns after which the tracked yaw is too old to hold a heading
            yaw_rate = max(-YAW_RATE, min(YAW_RATE, 1.5 * wrapped(self._heading - yaw)))  # 1/s
        return self._whole(to_body(velocity, yaw), yaw_rate)

    def _whole(self, velocity: Vector, yaw_rate: float) -> Sticks:
        if velocity == ZERO and not yaw_rate:
            self._rest = (0.0, 0.0, 0.0, 0.0)
            return CENTRED
        exact = stick_values(velocity, yaw_rate, self._gains)
        wanted = [value + rest for value, rest in zip(exact, self._rest, strict=True)]
        whole = [max(-100, min(100, round(value))) for value in wanted]
        a, b, c, d = (max(-1.0, min(1.0, value - n)) for value, n in zip(wanted, whole, strict=True))
        self._rest = (a, b, c, d)
        return Sticks(*whole)
