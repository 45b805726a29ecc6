"""The rules and warnings of a swarm file about Tellos: addresses and stick ranges."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator

from flockwire_core.swarm.airframes import TELLO
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.rules import needs

from flockwire_tello.sticks import full_speed
from flockwire_tello.swarm_file import reached, table_of, tello_addresses


@needs("drones.airframe", "drones.tello", "airframes")
def ip4_addresses(swarm: Swarm) -> Iterator[str]:
    """Yield values that are not IPv4 addresses."""
    for place, drone in enumerate(swarm.drones):
        for key in ("address", "local_ip"):
            if (address := getattr(table_of(drone), key, None)) is None:
                continue
            try:
                ipaddress.IPv4Address(address)
            except ValueError:
                yield f"drones.{place}.tello.{key} = {address!r}: must be an IPv4 address"


@needs("drones", "airframes", "gateway.source", "network.base_port")
def places(swarm: Swarm) -> Iterator[str]:
    """Yield Tellos with the same address, and drivers of one host that would receive each other's datagrams."""
    owners: dict[object, int] = {}
    for number in swarm.of_kind(TELLO):
        table, (drone, local), host = reached(swarm, number), tello_addresses(swarm, number), swarm.drone(number).host
        if (other := owners.setdefault(drone, number)) != number:
            yield f"drones.tello.address = {drone!r}: {uav(number)} and {uav(other)} have one address"
        for key in ("command_port", "state_port"):
            if (other := owners.setdefault((host, local, getattr(table, key)), number)) != number:
                yield (
                    f"drones.tello.local_ip: the drivers of {uav(other)} and {uav(number)} would both bind {local}, "
                    f"port {getattr(table, key)}; give this host an address for each and name it: tello.local_ip"
                )


def warnings(swarm: Swarm) -> Iterator[str]:
    """Yield stick gains that are too small for the formation's speed."""
    needed = swarm.survey().max_speed
    for name in sorted({swarm.drone(number).airframe for number in swarm.of_kind(TELLO)}):
        fastest = full_speed(swarm.airframes[name])
        if fastest < needed:
            yield (
                f"airframes.{name}.stick_gains let it fly {fastest:.2f} m/s at full stick, the formation needs "
                f"{needed:.2f} m/s; `flockwire identify` measures them"
            )


RULES = (ip4_addresses, places)
