"""Identities and endpoints: which processes a swarm has, on which host each runs and where it listens.

The order of identities decides who dials: of two linked processes the one further down the list dials the other. The
operator stands last and is dialled by nobody, so it has no endpoint and may be there any number of times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flockwire.control.graph import LEADER

if TYPE_CHECKING:
    from flockwire.config import Swarm
    from flockwire.tables import Host

PROCESS_IDENTITIES = ("router", "gateway", "kinematics", "leader", "recorder")
ROUTER = "router"
OPERATOR = "operator"


def agent_identity(number: int) -> str:
    """Return the identity of the process that flies drone `number`: the leader's, or that of a follower's agent."""
    return "leader" if number == LEADER else f"uav{number}"


def identities(swarm: Swarm) -> tuple[str, ...]:
    """Return the identities of all processes, the order of dialling."""
    agents = tuple(agent_identity(i) for i in swarm.followers)
    router = (ROUTER,) if swarm.network.mode == "router" else ()
    return (*router, "gateway", "kinematics", "leader", *agents, "recorder", OPERATOR)


def host_of(swarm: Swarm, identity: str) -> str:
    """Return the name of the host that runs `identity`."""
    for name, host in swarm.hosts.items():
        if identity in host.processes:
            return name
    number = next((drone for drone in swarm.drones if agent_identity(drone.id) == identity), None)
    if number is not None and number.host is not None:
        return number.host
    return next(iter(swarm.hosts))


def processes_on(swarm: Swarm, host: str) -> tuple[str, ...]:
    """Return the identities that host `host` runs (the operator is a person's, not a host's)."""
    return tuple(identity for identity in identities(swarm)[:-1] if host_of(swarm, identity) == host)


def endpoints(swarm: Swarm) -> dict[str, str]:
    """Return `IP:PORT` of every process that listens: all but the operator, in router mode the router alone."""
    own = {agent_identity(drone.id): drone.address for drone in swarm.drones if drone.address is not None}
    listening = (ROUTER,) if swarm.network.mode == "router" else identities(swarm)[:-1]
    return {
        identity: own.get(identity) or _join(_host(swarm, identity).address, swarm.network.base_port + place)
        for place, identity in enumerate(listening)
    }


def _host(swarm: Swarm, identity: str) -> Host:
    return swarm.hosts[host_of(swarm, identity)]


def _join(address: str, port: int) -> str:
    return f"[{address}]:{port}" if ":" in address else f"{address}:{port}"
