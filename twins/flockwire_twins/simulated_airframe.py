"""What the core of all simulated airframes needs of one with a driver; one without is a SimulatedDrone."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.vector import Vector
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


class Served(Protocol):
    """A simulated airframe with a driver: they exchange datagrams, it at its own address. Times are Unix ns."""

    @property
    def airframe(self) -> Body:
        """What flies."""

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""

    def advance(self, now: int) -> None:
        """Advance to `now`."""

    @property
    def address(self) -> Address:
        """Its address."""

    def datagram(self, data: bytes, sender: Address, now: int) -> None:
        """Receive a datagram from its driver."""

    def outgoing(self, now: int) -> list[Datagram]:
        """Return the datagrams that it sends up to `now`."""
