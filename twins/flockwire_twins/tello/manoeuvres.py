"""A Tello's manoeuvres: take-off, landing, waypoints, turns. Each returns a velocity until it is done.

v_u = limit(K (target − position), speed),   omega_u = limit(K_yaw (heading − yaw), rate)
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from flockwire_core.domain.vector import ZERO, Vector, limit, norm, scale, subtract
from flockwire_tello.sticks import to_body

from flockwire_twins.tello.airframe import AirframeMotion

POSITION_GAIN = 1.2  # 1/s
ARRIVED = 0.03  # m
TURNED = pi / 360.0  # rad
CLIMB = 0.6  # m/s
TURN_RATE = 1.2  # rad/s


class Setpoint(NamedTuple):
    """A command to the airframe: body velocity (FLU, m/s), yaw rate (rad/s, ccw)."""

    velocity: Vector
    yaw_rate: float


HOVER = Setpoint(ZERO, 0.0)


class Pause(NamedTuple):
    """Does nothing until a time (ns); a flip is simulated only by its time."""

    until: int

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        return None if now >= self.until else HOVER


class TakeOff(NamedTuple):
    """Motors until `climb` (ns), then a climb to `height` (m, world z); over at `until` (ns)."""

    height: float
    climb: int
    until: int

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        if now >= self.until:
            return None
        if now < self.climb:
            return HOVER
        speed = max(-CLIMB, min(CLIMB, POSITION_GAIN * (self.height - motion.position[2])))
        return Setpoint((0.0, 0.0, speed), 0.0)


class Landing(NamedTuple):
    """Straight down at `sink` m/s, to `ground` (m, world z)."""

    ground: float
    sink: float

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        if motion.position[2] <= self.ground:
            return None
        return Setpoint((0.0, 0.0, -self.sink), 0.0)


class Legs(NamedTuple):
    """From point to point (m, world frame), at `speed` m/s; it stops only at the last. Passed points are removed."""

    points: list[Vector]
    speed: float

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        to_go = subtract(self.points[0], motion.position)
        last = len(self.points) == 1
        if not last and norm(to_go) < self.speed / POSITION_GAIN:
            self.points.pop(0)
        elif last and norm(to_go) < ARRIVED and norm(motion.velocity) < ARRIVED:
            return None
        return Setpoint(to_body(limit(scale(to_go, POSITION_GAIN), self.speed), motion.yaw), 0.0)


class Turn(NamedTuple):
    """A turn to a heading (rad, ccw, not wrapped)."""

    heading: float

    def setpoint(self, motion: AirframeMotion, now: int) -> Setpoint | None:
        """Return what to command at `now`."""
        to_go = self.heading - motion.yaw
        if abs(to_go) < TURNED and abs(motion.yaw_rate) < 4.0 * TURNED:
            return None
        return Setpoint(ZERO, max(-TURN_RATE, min(TURN_RATE, 2.5 * to_go)))  # 1/s


Manoeuvre = Pause | TakeOff | Landing | Legs | Turn
