"""Velocities as stick values, and back: the command `rc a b c d`.

    a = −v_y / g_x,   b = v_x / g_y,   c = v_z / g_z,   d = −omega / g_yaw        (g: what one unit of a stick is worth)

v in the body frame FLU (x forward, y left, z up), omega counter-clockwise; the drone counts right, forward, up and
clockwise as positive, each from −100 to 100 (SDK 2.0 user guide, `rc`). No guide documents the gain of a unit; users
assume 1 cm/s.
"""

from __future__ import annotations

import re
from math import cos, isfinite, sin
from typing import TYPE_CHECKING, NamedTuple

from flockwire_core.domain.vector import Vector

from flockwire_tello.swarm_file import StickGains, tello_keys

if TYPE_CHECKING:
    from flockwire_core.swarm.drones import Airframe

FULL = 100  # largest stick value

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
