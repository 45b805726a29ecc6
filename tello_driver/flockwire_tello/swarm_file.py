"""The swarm file's keys for Tellos: [drones.tello], keys of [airframes.NAME], and addresses.

A simulated Tello has its own address in 127.0.0.0/8, and so has the driver of any Tello on loopback. Swarms on one host
with different ports (`network.base_port`) have different addresses.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from flockwire_core.swarm.tables import Ip4, Model, Port, Positive, key

if TYPE_CHECKING:
    from flockwire_core.swarm.drones import Airframe
    from flockwire_core.swarm.model import Swarm

COMMAND_PORT = 8889  # of every Tello
SPACING = 16  # of base ports: swarms with nearer base ports cannot run at the same time
MOST_DRONES = 1024
ANY = "0.0.0.0"  # noqa: S104  (all addresses of the host: which of them is in the drone's network is not known)


class Tello(Model):
    """The addresses by which a driver reaches its Tello."""

    address: Ip4 | None = key(None, 'the drone\'s own IPv4 address, "192.168.10.1"; default: it is simulated')
    local_ip: Ip4 | None = key(
        None, "of the host, for the driver; default: all, or its own if the drone is on loopback"
    )
    command_port: Port = key(8889, "of the host")
    state_port: Port = key(8890, "of the host")
    source_filter: bool = key(
        True, "accepts datagrams only from the drone's address; off behind an address translation"
    )


class StickGains(Model):
    """Velocity per unit of each stick of a Tello: m/s, for yaw rad/s. Assumed; `flockwire identify` measures it."""

    right: Positive = key(0.01, "to the right", "m/s")
    forward: Positive = key(0.01, "forward", "m/s")
    up: Positive = key(0.01, "upward", "m/s")
    clockwise: Positive = key(0.01745, "of yaw", "rad/s")


class TelloInDrones(Model):
    """The keys of [[drones]] for a Tello."""

    tello: Tello | None = key(None, "addresses of a Tello; default: the drone is simulated")


class TelloInAirframes(Model):
    """The keys of [airframes.NAME] for a Tello."""

    stick_gains: StickGains = key(StickGains(), "velocity per stick unit of a Tello")
    rc_rate_hz: int = key(50, "rate of stick commands of a Tello's driver", "Hz", ge=5, le=100)


class TelloAddresses(NamedTuple):
    """The address of a Tello, and the one that its driver binds."""

    drone: str
    local: str


def reached(swarm: Swarm, number: int) -> Tello:
    """Return the addresses of drone `number` of `swarm`, a Tello."""
    drone = swarm.drone(number)
    return (drone.tello if isinstance(drone, TelloInDrones) else None) or Tello()


def tello_keys(airframe: Airframe) -> TelloInAirframes:
    """Return the keys of [airframes.NAME] for a Tello; raises TypeError for a model without it."""
    if not isinstance(airframe, TelloInAirframes):
        raise TypeError(f"{airframe!r} has no keys of a Tello")
    return airframe


def tello_addresses(swarm: Swarm, number: int) -> TelloAddresses:
    """Return the addresses of drone `number` of `swarm`, a Tello."""
    table = reached(swarm, number)
    place = swarm.network.base_port // SPACING * MOST_DRONES + number
    drone = table.address or _loopback(1, place)
    own = _loopback(64, place) if ipaddress.ip_address(drone).is_loopback else ANY
    return TelloAddresses(drone, table.local_ip or own)


def identified(airframe: Airframe, gains: Mapping[str, float]) -> Iterator[str]:
    """Yield the keys of [airframes.NAME] after `flockwire identify`, from flown over commanded velocity by axis."""
    known = tello_keys(airframe).stick_gains
    worth = ", ".join(f"{axis} = {getattr(known, axis) * gain:.5f}" for axis, gain in gains.items())
    yield f"stick_gains = {{ {worth} }}"


def _loopback(block: int, place: int) -> str:
    return f"127.{block + (place >> 16)}.{place >> 8 & 255}.{place & 255}"
