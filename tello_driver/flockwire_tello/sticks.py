"""Velocities as stick values, and back: the command `rc a b c d`.

    a = −v_y / g_x,   b = v_x / g_y,   c = v_z / g_z,   d = −omega / g_yaw        (g: what one unit of a stick is worth)

v in the body frame FLU (x forward, y left, z up), omega counter-clockwise; the drone counts right, forward, up and
clockwise as positive, each from −100 to 100 (SDK 2.0 user guide, `rc`). No guide documents the gain of a unit; users
assume 1 cm/s.

    omega = limit(K_yaw wrap(heading − yaw), rate)                            holds the heading
    n_k = round(s_k + e_k),   e_{k+1} = s_k + e_k − n_k                       carries what rounding leaves over

s is the exact stick value. The average of a few `rc` is exact, though each is a whole number: a Tello's smallest step
is about 1 cm/s.
"""

from __future__ import annotations

import re
from math import cos, isfinite, sin
from typing import TYPE_CHECKING, NamedTuple

from flockwire_core.domain.pose import Quaternion, wrapped, yaw_of
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector

from flockwire_tello.swarm_file import StickGains, tello_keys

if TYPE_CHECKING:
    from flockwire_core.swarm.drones import Airframe

FULL = 100  # largest stick value
YAW_RATE = 0.6  # rad/s, at most

_COMMAND = re.compile(r"rc" + r" +(-?[0-9]{1,4})" * 4)


class Sticks(NamedTuple):
    """Four stick values, −100 to 100."""

    right: int
    forward: int
    up: int
    clockwise: int

    @property
    def command(self) -> str:
        """The command that sets them."""
        return f"rc {self.right} {self.forward} {self.up} {self.clockwise}"


CENTRED = Sticks(0, 0, 0, 0)


def to_body(velocity: Vector, yaw: float) -> Vector:
    """Return a world velocity (ENU) in the body frame FLU of a drone with heading `yaw` (rad, ccw from world x)."""
    x, y, z = velocity
    c, s = cos(yaw), sin(yaw)
    return (c * x + s * y, c * y - s * x, z)


def to_world(velocity: Vector, yaw: float) -> Vector:
    """Return a body velocity (FLU) in the world frame (ENU); the inverse of `to_body`."""
    return to_body(velocity, -yaw)


def stick_values(velocity: Vector, yaw_rate: float, gains: StickGains) -> tuple[float, float, float, float]:
    """Return the stick values, not rounded, for a body velocity (FLU, m/s) and a yaw rate (rad/s, ccw).

    If a stick would exceed 100, the whole velocity is scaled down and keeps its direction; yaw is clipped separately.
    Raises ValueError if a number is not finite.
    """
    wanted = (-velocity[1] / gains.right, velocity[0] / gains.forward, velocity[2] / gains.up)
    turn = -yaw_rate / gains.clockwise
    if not all(map(isfinite, (*wanted, turn))):
        raise ValueError(f"velocity {velocity}, yaw rate {yaw_rate}: must be finite")
    scale = FULL / max(FULL, *map(abs, wanted))
    right, forward, up = (value * scale for value in wanted)
    return (right, forward, up, max(-FULL, min(FULL, turn)))


def full_speed(airframe: Airframe) -> float:
    """Return the horizontal speed, m/s, that a Tello of `airframe` reaches in every direction at full stick."""
    gains = tello_keys(airframe).stick_gains
    return FULL * min(gains.right, gains.forward)


def to_velocity(sticks: Sticks, gains: StickGains) -> tuple[Vector, float]:
    """Return body velocity (FLU, m/s) and yaw rate (rad/s, ccw) that sticks command; the inverse of `stick_values`."""
    velocity = (sticks.forward * gains.forward, -sticks.right * gains.right, sticks.up * gains.up)
    return velocity, -sticks.clockwise * gains.clockwise


def parse_sticks(command: str) -> Sticks | None:
    """Return the sticks of an `rc` command, None if it is not one or a value is out of range."""
    found = _COMMAND.fullmatch(command.strip())
    if found is None:
        return None
    sticks = Sticks(*map(int, found.groups()))
    return sticks if all(abs(value) <= FULL for value in sticks) else None


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
