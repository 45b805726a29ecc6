"""Where each Tello of a swarm is, and what its driver binds.

A simulated one has an address of its own in 127.0.0.0/8, and so has the driver of any Tello on loopback: two swarms on
one host that have different ports (`network.base_port`) have different addresses.
"""

from __future__ import annotations

import ipaddress
from typing import NamedTuple

from flockwire.swarm.model import Swarm

COMMAND_PORT = 8889  # of every Tello
SPACING = 16  # of base ports: swarms whose base ports are nearer cannot run side by side
MOST_DRONES = 1024
ANY = "0.0.0.0"  # noqa: S104  (all addresses of the host: which of them is in the drone's network is not known)


class TelloAddresses(NamedTuple):
    """The address of a Tello, and the one that its driver binds."""

    drone: str
    local: str


def tello_addresses(swarm: Swarm, number: int) -> TelloAddresses:
    """Return the addresses of drone `number` of `swarm`, a Tello."""
    table = swarm.tello(number)
    place = swarm.network.base_port // SPACING * MOST_DRONES + number
    drone = table.address or _loopback(1, place)
    own = _loopback(64, place) if ipaddress.ip_address(drone).is_loopback else ANY
    return TelloAddresses(drone, table.local_ip or own)


def _loopback(block: int, place: int) -> str:
    return f"127.{block + (place >> 16)}.{place >> 8 & 255}.{place & 255}"
