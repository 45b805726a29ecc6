"""Commands and telemetry of an airframe."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector


class FlightState(IntEnum):
    """The flight state of an airframe."""

    GROUNDED = 0
    FLYING = 1
    LANDING = 2
    STOPPED = 3
    HELD = 4  # off the ground with stopped motors: held in a hand


@mypyc_attr(acyclic=True)
class Command(Record):
    """A velocity to fly at, m/s, world frame; the stamp (Unix ns) is that of the drone's pose that it answers."""

    __slots__ = ("stamp", "frame", "velocity", "yaw_rate")

    def __init__(self, stamp: int, frame: str, velocity: Vector, yaw_rate: float = 0.0) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.velocity: Final = velocity
        self.yaw_rate: Final = yaw_rate  # rad/s, counter-clockwise


@mypyc_attr(acyclic=True)
class Telemetry(Record):
    """The state of an airframe at `stamp` (Unix ns).

    After an emergency stop `stop_received` is true; the state is STOPPED when the drone is known to be down.
    """

    __slots__ = ("stamp", "frame", "state", "battery", "height", "command_age", "stop_received")

    def __init__(
        self,
        stamp: int,
        frame: str,
        state: FlightState,
        battery: float,
        height: float,
        command_age: float,
        stop_received: bool = False,
    ) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.state: Final = state
        self.battery: Final = battery  # share of full, 0 to 1
        self.height: Final = height  # m above the ground
        self.command_age: Final = command_age  # s since the last command; -1 before the first
        self.stop_received: Final = stop_received
