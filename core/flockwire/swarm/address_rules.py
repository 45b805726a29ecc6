"""The rules of a swarm file about hosts and Tellos: their addresses, and what would take another's place."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator

from flockwire.swarm.model import Swarm, uav
from flockwire.swarm.rule import needs
from flockwire.swarm.tello_addresses import tello_addresses


@needs("hosts", "drones.address")
def hosts(swarm: Swarm) -> Iterator[str]:
    """Yield what is wrong with the names and addresses of hosts, and with addresses of drones."""
    if not swarm.hosts:
        yield "hosts = {}: at least one host is needed (leave the table out for one called local)"
    for name, host in swarm.hosts.items():
        if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?", name):
            yield f"hosts.{name}: must be a host name: letters, digits and hyphens, at most 63"
        yield from _ip(f"hosts.{name}.address", host.address)
    for place, drone in enumerate(swarm.drones):
        yield from _address(f"drones.{place}.address", drone.address)


def _address(key: str, address: str | None) -> Iterator[str]:
    if address is None:
        return
    split = re.fullmatch(r"(?:\[(?P<v6>[^]]+)\]|(?P<v4>[^:]+)):(?P<port>[0-9]{4,5})", address)
    if split is None or not 1024 <= int(split["port"]) <= 65535:
        yield f"{key} = {address!r}: must be IP:PORT, PORT from 1024 to 65535 (IPv6: [IP]:PORT)"
        return
    yield from _ip(key, split["v6"] or split["v4"])


def _ip(key: str, text: str) -> Iterator[str]:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        yield f"{key} = {text!r}: must be an IP address"


@needs("drones.airframe", "drones.tello", "airframes")
def tello_tables(swarm: Swarm) -> Iterator[str]:
    """Yield what is wrong with each table of a Tello by itself."""
    for place, drone in enumerate(swarm.drones):
        frame, table = swarm.airframes.get(drone.airframe), drone.tello
        if table is None or frame is None:
            continue
        if frame.kind != "tello":
            yield f"drones.{place}.tello: airframe {drone.airframe!r} is of kind {frame.kind!r}, must be 'tello'"
        for key in ("address", "local_ip"):
            if (address := getattr(table, key)) is not None:
                yield from _ip4(f"drones.{place}.tello.{key}", address)


@needs("drones", "airframes", "gateway.source", "network.base_port")
def tellos(swarm: Swarm) -> Iterator[str]:
    """Yield two Tellos on one address, and two drivers of one host that would take each other's datagrams."""
    owners: dict[object, int] = {}
    for number in swarm.tellos:
        table, (drone, local), host = swarm.tello(number), tello_addresses(swarm, number), swarm.drone(number).host
        if (other := owners.setdefault(drone, number)) != number:
            yield f"drones.tello.address = {drone!r}: {uav(number)} and {uav(other)} have one address"
        for key in ("command_port", "state_port"):
            if (other := owners.setdefault((host, local, getattr(table, key)), number)) != number:
                yield (
                    f"drones.tello.local_ip: the drivers of {uav(other)} and {uav(number)} would both bind {local}, "
                    f"port {getattr(table, key)}; give this host an address for each and name it: tello.local_ip"
                )
        if table.address is not None and swarm.gateway.source == "simulated":
            yield (
                f"drones.tello.address = {drone!r}: no tracker sees {uav(number)}, gateway.source = 'simulated'; name "
                "a real tracker there, or leave the address out to simulate the drone"
            )


def _ip4(key: str, text: str) -> Iterator[str]:
    try:
        ipaddress.IPv4Address(text)
    except ValueError:
        yield f"{key} = {text!r}: must be an IPv4 address"
