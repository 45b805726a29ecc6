"""Commands and telemetry of an airframe."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from flockwire.domain.vector import Vector


class FlightState(IntEnum):
    """The flight state of an airframe."""

    GROUNDED = 0
    FLYING = 1
    LANDING = 2
    STOPPED = 3
    HELD = 4  # off the ground with stopped motors: held in a hand


class Command(NamedTuple):
    """A velocity to fly at, m/s, world frame; the stamp (Unix ns) is that of the drone's pose that it answers."""

    stamp: int
    frame: str
    velocity: Vector
    yaw_rate: float = 0.0  # rad/s, counter-clockwise


class Telemetry(NamedTuple):
    """The state of an airframe at `stamp` (Unix ns).

    After an emergency stop `stop_received` is true; the state is STOPPED when the drone is known to be down.
    """

    stamp: int
    frame: str
    state: FlightState
    battery: float  # share of full, 0 to 1
    height: float  # m above the ground
    command_age: float  # s since the last command; -1 before the first
    stop_received: bool = False
