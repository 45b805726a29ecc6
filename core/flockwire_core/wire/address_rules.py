"""The rules of a swarm file about hosts and addresses: every process can be reached."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.rules import Rule, needs
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import DRIVER, KINEMATICS, PROCESSES

LOWEST_PORT, HIGHEST_PORT = 1024, 65535


@needs("hosts", "drones.address")
def _hosts(swarm: Swarm) -> Iterator[str]:
    """Yield problems of hosts' names and addresses, and of drones' addresses."""
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
    if split is None or not LOWEST_PORT <= int(split["port"]) <= HIGHEST_PORT:
        yield f"{key} = {address!r}: must be IP:PORT, PORT from {LOWEST_PORT} to {HIGHEST_PORT} (IPv6: [IP]:PORT)"
        return
    yield from _ip(key, split["v6"] or split["v4"])


def _ip(key: str, text: str) -> Iterator[str]:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        yield f"{key} = {text!r}: must be an IP address"


@needs("hosts", "drones.id", "drones.host", "drones.address", "network", "leader.kind", "graph", "avoidance", "ros")
def _endpoints(swarm: Swarm) -> Iterator[str]:
    plan = Plan(swarm)
    yield from _processes(plan)
    yield from _unreachable(swarm)
    yield from _ports(plan)
    yield from _addresses(plan)
    yield from _security(plan)
    yield from _simulated_airframes(plan)


def _unreachable(swarm: Swarm) -> Iterator[str]:
    """Yield hosts that listen at loopback, or at every address, beside hosts in a network: those cannot dial them."""
    addresses = {name: ipaddress.ip_address(host.address) for name, host in swarm.hosts.items()}
    hidden = [name for name, address in addresses.items() if address.is_loopback or address.is_unspecified]
    if len(hidden) == len(addresses):
        return
    for name in hidden:
        yield (
            f"hosts.{name}.address = '{addresses[name]}': the other hosts cannot reach it there; name its address in "
            "their network"
        )


def _processes(plan: Plan) -> Iterator[str]:
    # Kinds that this swarm does not have may be named too: the router's host stays in the file when its mode changes.
    known = [row.kind for row in PROCESSES if row.started and not row.numbered]
    claimed: dict[str, str] = {}
    for name, host in plan.swarm.hosts.items():
        for process in host.processes:
            if process not in known:
                yield f"hosts.{name}.processes has {process!r}: must be one of {known}"
            elif process in claimed:
                yield f"hosts.{name}.processes has {process!r}: host {claimed[process]} runs it already"
            claimed.setdefault(process, name)


def _ports(plan: Plan) -> Iterator[str]:
    base = plan.swarm.network.base_port
    for identity, endpoint in (*plan.endpoints.items(), *plan.reserved.items()):
        port = int(endpoint.rpartition(":")[2])
        if not LOWEST_PORT <= port <= HIGHEST_PORT:
            bound = f"highest is {HIGHEST_PORT}" if port > HIGHEST_PORT else f"lowest is {LOWEST_PORT}"
            yield f"network.base_port = {base}: {identity} would listen at port {port}, the {bound}"


def _addresses(plan: Plan) -> Iterator[str]:
    owners: dict[str, str] = {}
    for identity, endpoint in (*plan.endpoints.items(), *plan.reserved.items()):
        if endpoint in owners:
            yield f"drones.address: {identity} and {owners[endpoint]} have one address, {endpoint}"
        owners[endpoint] = identity
    ros = plan.swarm.ros
    if ros is not None and ros.serve and ros.router in owners:
        yield f"ros.router = {ros.router!r}: {owners[ros.router]} listens there; choose another port"


def _security(plan: Plan) -> Iterator[str]:
    if plan.swarm.network.security != "none":
        return
    for identity, endpoint in plan.endpoints.items():
        if not ipaddress.ip_address(endpoint.rpartition(":")[0].strip("[]")).is_loopback:
            yield (
                f"network.security = 'none': {identity} would listen at {endpoint}; without security only loopback "
                "addresses are allowed"
            )


def _simulated_airframes(plan: Plan) -> Iterator[str]:
    """Yield drivers on another host than their simulated airframes, which use their host's loopback."""
    served = next(iter(plan.of_kind(KINEMATICS.kind)), None)
    for driver in plan.of_kind(DRIVER.kind):
        drone = plan.members[driver].drone
        if served is not None and drone in plan.swarm.simulated and plan.hosts[driver] != plan.hosts[served]:
            yield (
                f"drones.host: {driver} runs on {plan.hosts[driver]}, its simulated airframe on {plan.hosts[served]}; "
                f"both must be on one host (hosts.{plan.hosts[driver]}.processes)"
            )


RULES: tuple[Rule, ...] = (_hosts, _endpoints)
