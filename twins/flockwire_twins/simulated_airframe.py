"""What the core of all simulated airframes needs of one: the interface of the airframe table's `simulated`."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.process.cores import Address, Datagram

from flockwire_twins.wind import Wind


class Wear(NamedTuple):
    """What is wrong with an airframe: shares of its mass, its autopilot's gains, each rotor's thrust and torque."""

    mass: float = 1.0
    gains: float = 1.0
    rotors: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)


class Body(Protocol):
    """What flies of an airframe."""

    position: Vector  # m, world frame
    orientation: Quaternion  # x, y, z, w

    def stop(self) -> None:
        """Stop the motors: in flight it falls."""

    def respond(self, lag: float, dead_time: float) -> None:
        """Set lag and dead time, s."""

    def blow(self, wind: Wind) -> None:
        """Set the wind from now on."""


class WearingBody(Body, Protocol):
    """A body that may be worn, and tells of it."""

    failure: str  # why it stopped its motors by itself, empty if it did not

    @property
    def remark(self) -> str:
        """What is at its limit."""

    def wear(self, wear: Wear) -> None:
        """Set what is wrong with it, if its row `wears`."""


class SimulatedAirframe(Protocol):
    """One simulated airframe; times are Unix ns."""

    @property
    def airframe(self) -> Body:
        """What flies."""

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""

    def advance(self, now: int) -> None:
        """Advance to `now`."""


class Commanded(SimulatedAirframe, Protocol):
    """An airframe whose row has no driver: it obeys commands itself."""

    @property
    def airframe(self) -> WearingBody:
        """What flies."""

    clipped: int  # commands that were too fast
    land_at: int | None  # time of its own landing

    def command(self, velocity: Vector, now: int, yaw_rate: float = 0.0, acceleration: Vector = ZERO) -> None:
        """Receive a commanded velocity, m/s, world frame, a yaw rate, rad/s, and an acceleration, m/s^2."""

    def telemetry(self, now: int, frame: str) -> Telemetry:
        """Return its telemetry, in the world frame `frame`."""


class Served(SimulatedAirframe, Protocol):
    """An airframe whose row has a driver: it exchanges datagrams with the driver, at its own address."""

    @property
    def address(self) -> Address:
        """Its address."""

    def datagram(self, data: bytes, sender: Address, now: int) -> None:
        """Receive a datagram from its driver."""

    def outgoing(self, now: int) -> list[Datagram]:
        """Return the datagrams that it sends up to `now`."""
