"""Commands and telemetry of an airframe."""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import ZERO, Vector


class FlightState(IntEnum):
    """The flight state of an airframe."""

    GROUNDED = 0
    FLYING = 1
    LANDING = 2
    STOPPED = 3
    HELD = 4  # off the ground with stopped motors: held in a hand


@mypyc_attr(acyclic=True)
class Command(Record):
    """A velocity to fly at, m/s, world frame; the stamp (Unix ns) is that of the drone's pose that it answers.

    `acceleration` is how that velocity changes, of a law that commands accelerations, for an airframe that takes them.
    """

    __slots__ = ("stamp", "frame", "velocity", "yaw_rate", "acceleration")

    def __init__(
        self, stamp: int, frame: str, velocity: Vector, yaw_rate: float = 0.0, acceleration: Vector = ZERO
    ) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.velocity: Final = velocity
        self.yaw_rate: Final = yaw_rate  # rad/s, counter-clockwise
        self.acceleration: Final = acceleration  # m/s^2, world frame


class Steer(NamedTuple):
    """A velocity, m/s, world frame, at which a leader is to fly, at `stamp` (Unix ns)."""

    stamp: int
    frame: str
    velocity: Vector


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
