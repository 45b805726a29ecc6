"""A Tello's manoeuvres: take-off, landing, waypoints, turns. Each gives a velocity until it is done.

v_u = limit(K (target − position), speed),   omega_u = limit(K_yaw (heading − yaw), rate)
"""

from __future__ import annotations

from collections.abc import Callable
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

Manoeuvre = Callable[[AirframeMotion, int], Setpoint | None]
"""Returns what to command at a motion and a time (ns); None once it is done."""


def pause(until: int) -> Manoeuvre:
    """Do nothing until a time (ns); a flip is simulated only by its time."""
    return lambda motion, now: None if now >= until else HOVER


def take_off(height: float, climb: int, until: int) -> Manoeuvre:
    """Run the motors until `climb` (ns), then climb to `height` (m, world z); over at `until` (ns)."""

    def setpoint(motion: AirframeMotion, now: int) -> Setpoint | None:
        if now >= until:
            return None
        speed = max(-CLIMB, min(CLIMB, POSITION_GAIN * (height - motion.position[2])))
        return HOVER if now < climb else Setpoint((0.0, 0.0, speed), 0.0)

    return setpoint


def landing(ground: float, sink: float) -> Manoeuvre:
    """Fly straight down at `sink` m/s, to `ground` (m, world z)."""
    return lambda motion, now: None if motion.position[2] <= ground else Setpoint((0.0, 0.0, -sink), 0.0)


def legs(points: list[Vector], speed: float) -> Manoeuvre:
    """Fly from point to point (m, world frame), at `speed` m/s; it stops only at the last. Removes passed points."""

    def setpoint(motion: AirframeMotion, now: int) -> Setpoint | None:
        to_go = subtract(points[0], motion.position)
        last = len(points) == 1
        if not last and norm(to_go) < speed / POSITION_GAIN:
            points.pop(0)
        elif last and norm(to_go) < ARRIVED and norm(motion.velocity) < ARRIVED:
            return None
        return Setpoint(to_body(limit(scale(to_go, POSITION_GAIN), speed), motion.yaw), 0.0)

    return setpoint


def turn(heading: float) -> Manoeuvre:
    """Turn to a heading (rad, ccw, not wrapped)."""

    def setpoint(motion: AirframeMotion, now: int) -> Setpoint | None:
        to_go = heading - motion.yaw
        if abs(to_go) < TURNED and abs(motion.yaw_rate) < 4.0 * TURNED:
            return None
        return Setpoint(ZERO, max(-TURN_RATE, min(TURN_RATE, 2.5 * to_go)))  # 1/s

    return setpoint
