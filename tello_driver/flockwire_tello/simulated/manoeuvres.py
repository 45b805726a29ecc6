"""A Tello's manoeuvres: take-off, landing, waypoints, turns. Each returns a velocity until it is done.

v_u = limit(K (target − position), speed),   omega_u = limit(K_yaw (heading − yaw), rate)
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple, Protocol

from flockwire.domain.time import nanoseconds
from flockwire.domain.vector import ZERO, Vector, limit, norm, scale, subtract

from flockwire_tello.simulated.airframe import AirframeMotion
from flockwire_tello.sticks import to_body

POSITION_GAIN = 1.2  # 1/s
YAW_GAIN = 2.5  # 1/s
ARRIVED = 0.03  # m
TURNED = pi / 360.0  # rad
CLIMB = 0.6  # m/s
TURN_RATE = 1.2  # rad/s


class Setpoint(NamedTuple):
    """A command to the airframe: body velocity (FLU, m/s), yaw rate (rad/s, ccw)."""

    velocity: Vector
    yaw_rate: float


HOVER = Setpoint(ZERO, 0.0)


class Manoeuvre(Protocol):
    """A manoeuvre of the flight controller."""

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return the setpoint at `now` (ns), None when it is done."""


class Pause:
    """Does nothing for a time; a flip is simulated only by its time."""

    def __init__(self, seconds: float, now: int) -> None:
        self._until = now + nanoseconds(seconds)

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        return None if now >= self._until else HOVER


class TakeOff:
    """Motors for `spin_up` s, then a climb to `height` (m, world z); over when `seconds` have passed."""

    def __init__(self, height: float, seconds: float, now: int, spin_up: float = 0.8) -> None:
        self._height = height
        self._climb, self._until = now + nanoseconds(spin_up), now + nanoseconds(seconds)

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        if now >= self._until:
            return None
        if now < self._climb:
            return HOVER
        speed = max(-CLIMB, min(CLIMB, POSITION_GAIN * (self._height - motion.position[2])))
        return Setpoint((0.0, 0.0, speed), 0.0)


class Landing:
    """Straight down at `sink` m/s, to `ground` (m, world z)."""

    def __init__(self, ground: float, sink: float) -> None:
        self._ground, self._sink = ground, sink

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        if motion.position[2] <= self._ground:
            return None
        return Setpoint((0.0, 0.0, -self._sink), 0.0)


class Legs:
    """From point to point (m, world frame), at `speed` m/s; it stops only at the last."""

    def __init__(self, points: tuple[Vector, ...], speed: float) -> None:
        self._points, self._speed = list(points), speed

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        to_go = subtract(self._points[0], motion.position)
        last = len(self._points) == 1
        if not last and norm(to_go) < self._speed / POSITION_GAIN:
            self._points.pop(0)
        elif last and norm(to_go) < ARRIVED and norm(motion.velocity) < ARRIVED:
            return None
        return Setpoint(to_body(limit(scale(to_go, POSITION_GAIN), self._speed), motion.yaw), 0.0)


class Turn:
    """A turn to a heading (rad, ccw, not wrapped)."""

    def __init__(self, heading: float) -> None:
        self._heading = heading

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        to_go = self._heading - motion.yaw
        if abs(to_go) < TURNED and abs(motion.yaw_rate) < 4.0 * TURNED:
            return None
        return Setpoint(ZERO, max(-TURN_RATE, min(TURN_RATE, YAW_GAIN * to_go)))
