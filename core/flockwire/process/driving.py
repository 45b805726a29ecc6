"""What the processes of all airframes share: how one is driven and simulated, times, the ground."""

from __future__ import annotations

from typing import Protocol, cast

from flockwire.domain.airframe import Telemetry
from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector
from flockwire.objects import load_object
from flockwire.process.cores import Address, Core, Datagram, Start

TELEMETRY_PERIOD = SECOND // 10  # ns
SETTLED = SECOND  # ns that all drones are on the ground before the process may end
RETIREMENT = 20 * SECOND  # ns that pilots have to land their drones when the process is to end
TOLERANCE = 1.05  # share of the speed limit above which a command is clipped: the safety filter may touch the limit
GRAVITY = 9.81  # m/s^2
CONTACT = 0.01  # m above the ground at which a simulated airframe that sinks stands
FROZEN = SECOND // 4  # ns: over a longer pause of the process the simulated world is frozen, too


class SimulatedAirframe(Protocol):
    """One simulated airframe; times are Unix ns."""

    @property
    def position(self) -> Vector:
        """Where it is, m, world frame."""

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """How it is turned: a quaternion (x, y, z, w)."""

    @property
    def in_the_air(self) -> bool:
        """Whether it flies, lands or falls."""

    def advance(self, now: int) -> None:
        """Move on to `now`."""

    def stop(self) -> None:
        """Motors off: in flight it falls."""

    def respond(self, lag: float, dead_time: float) -> None:
        """Answer from now on with this lag and this dead time, s."""


class Commanded(SimulatedAirframe, Protocol):
    """One whose row has no driver: it obeys commands itself."""

    clipped: int  # commands that were too fast
    land_at: int | None  # when it lands by itself

    def command(self, velocity: Vector, now: int) -> None:
        """Receive a commanded velocity, m/s, world frame."""

    def telemetry(self, now: int, frame: str) -> Telemetry:
        """Return how it is, in the world frame `frame`."""


class Served(SimulatedAirframe, Protocol):
    """One whose row has a driver: it exchanges datagrams with that, at an address of its own."""

    @property
    def address(self) -> Address:
        """Where it is served."""

    def datagram(self, data: bytes, sender: Address, now: int) -> None:
        """Receive a datagram from its driver."""

    def outgoing(self, now: int) -> list[Datagram]:
        """Return what it sends up to `now`."""


def make_driver(start: Start) -> Core:
    """Return the core of the driver of one drone, as the airframe table names it."""
    return cast("Core", load_object(start.plan.swarm.row(start.drone).driver)(start))
