"""The rules of a swarm file about hosts: their names, their addresses, and those of drones' agents."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator

from flockwire.swarm.model import Swarm
from flockwire.swarm.rule import needs


@needs("hosts", "drones.address")
def hosts(swarm: Swarm) -> Iterator[str]:
    """Yield what is wrong with the names and addresses of hosts, and with addresses of drones."""
    if not swarm.hosts:
        yield "hosts = {}: at least one host is needed (without the table there is one called local)"
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
