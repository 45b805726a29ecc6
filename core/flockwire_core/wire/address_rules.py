"""The rules of a swarm file about hosts and addresses: every process can be reached."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.rules import Rule
from flockwire_core.swarm.tables import HIGHEST_PORT, LOWEST_PORT
from flockwire_core.swarm.validation import Problem
from flockwire_core.wire.plan import Plan, port_of
from flockwire_core.wire.processes import DRIVER, KINEMATICS, PROCESSES


def _placement(swarm: Swarm) -> Iterator[Problem]:
    plan = Plan(swarm)
    yield from _processes(plan)
    yield from _unreachable(swarm)
    yield from _endpoints(plan)
    yield from _simulated_airframes(plan)


def _unreachable(swarm: Swarm) -> Iterator[Problem]:
    """Yield hosts that listen at loopback, or at every address, beside hosts in a network: those cannot dial them."""
    addresses = {name: ipaddress.ip_address(host.address) for name, host in swarm.hosts.items()}
    hidden = [name for name, address in addresses.items() if address.is_loopback or address.is_unspecified]
    if len(hidden) < len(addresses):
        rule = "the other hosts cannot reach it there; name its address in their network"
        yield from (Problem(f"hosts.{name}.address", rule) for name in hidden)


def _processes(plan: Plan) -> Iterator[Problem]:
    # Kinds that this swarm does not have may be named too: the router's host stays in the file when its mode changes.
    kinds = [row.kind for row in PROCESSES if row.started and not row.numbered]
    known = list(dict.fromkeys((*kinds, *(one for one in plan.started if not plan.rows[one].numbered))))
    claimed: dict[str, str] = {}
    for name, host in plan.swarm.hosts.items():
        for place, process in enumerate(host.processes):
            key = f"hosts.{name}.processes.{place}"
            if process not in known:
                yield Problem(key, f"must be one of {known}")
            elif process in claimed:
                yield Problem(key, f"host {claimed[process]} runs it already")
            claimed.setdefault(process, name)


def _endpoints(plan: Plan) -> Iterator[Problem]:
    owners: dict[str, str] = {}
    for identity, endpoint in (*plan.endpoints.items(), *plan.reserved.items()):
        address, port = endpoint.rpartition(":")[0].strip("[]"), port_of(endpoint)
        if not LOWEST_PORT <= port <= HIGHEST_PORT:
            bound = f"highest is {HIGHEST_PORT}" if port > HIGHEST_PORT else f"lowest is {LOWEST_PORT}"
            yield Problem("network.base_port", f"{identity} would listen at port {port}, the {bound}")
        if endpoint in owners:
            yield Problem("drones.address", f"{identity} and {owners[endpoint]} have one address, {endpoint}")
        owners[endpoint] = identity
        if plan.swarm.network.security == "none" and not ipaddress.ip_address(address).is_loopback:
            rule = "without security only loopback addresses are allowed"
            yield Problem("network.security", f"{identity} would listen at {endpoint}; {rule}")
    ros = plan.swarm.ros
    if ros is not None and ros.serve and ros.router in owners:
        yield Problem("ros.router", f"{owners[ros.router]} listens there; choose another port")


def _simulated_airframes(plan: Plan) -> Iterator[Problem]:
    """Yield drivers on another host than their simulated airframes, which use their host's loopback."""
    served = next(iter(plan.of(KINEMATICS)), None)
    for driver in plan.of(DRIVER):
        drone = plan.members[driver].drone
        if served is not None and drone in plan.swarm.simulated and plan.hosts[driver] != plan.hosts[served]:
            where = f"{driver} runs on {plan.hosts[driver]}, its simulated airframe on {plan.hosts[served]}"
            yield Problem("drones.host", f"{where}; both must be on one host (hosts.{plan.hosts[driver]}.processes)")


RULES: tuple[Rule, ...] = (_placement,)
