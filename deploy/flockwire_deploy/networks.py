"""The private networks of a swarm of containers: as far as bridges allow, linked processes share one.

Two drones' processes (an edge of the graph, or a drone's agent and driver) share their own network. Every other process
has one network with all processes linked to it.
"""

from __future__ import annotations

from ipaddress import IPv4Network
from typing import NamedTuple

from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

POOL = 30  # networks that fit in an engine's default address pools
RANGE = IPv4Network("10.224.0.0/12")  # subnets of more networks, unless the user names another range
SPARE = 4  # reserved addresses of a network: its own, broadcast, the engine's, one for a restarted container


class RangeError(ValueError):
    """A range of addresses that is too small; the text is one line."""


class ContainerNetwork(NamedTuple):
    """One network: its name, members, and addresses unless the engine chooses them."""

    name: str
    members: tuple[str, ...]
    subnet: IPv4Network | None = None


def aboard(plan: Plan) -> tuple[str, ...]:
    """Return the processes of containers, in the order of the process table: all that `up` starts, and the operator."""
    return tuple(identity for identity in plan.certified if identity in plan.started or identity == OPERATOR.kind)


def networks(plan: Plan, within: IPv4Network | None = None) -> tuple[ContainerNetwork, ...]:
    """Return the networks of all containers, with subnets of `within` if given, or if they are many.

    Raises RangeError if they do not fit.
    """
    members = _members(plan)
    if within is None and len(members) <= POOL:
        return tuple(ContainerNetwork(name, on) for name, on in members.items())
    largest = max(len(on) for on in members.values()) + SPARE
    length = 32 - (largest - 1).bit_length()
    whole = within or RANGE
    if length < whole.prefixlen or 2 ** (length - whole.prefixlen) < len(members):
        raise RangeError(f"--subnets = {whole}: has no room for {len(members)} networks of {largest} addresses")
    subnets = whole.subnets(new_prefix=length)
    return tuple(ContainerNetwork(name, on, next(subnets)) for name, on in members.items())


def _members(plan: Plan) -> dict[str, tuple[str, ...]]:
    place = {identity: rank for rank, identity in enumerate(aboard(plan))}
    found: dict[str, set[str]] = {}
    for one, rank in place.items():
        for other in plan.links[one]:
            if place.get(other, rank) < rank:
                found.setdefault(_name(plan, other, one), set()).update((one, other))
    return {name: tuple(sorted(on, key=place.__getitem__)) for name, on in found.items()}


def _name(plan: Plan, one: str, other: str) -> str:
    """Return the network of the link between two processes, given in the order of the table."""
    shared = next((name for name in (one, other) if plan.members[name].drone is None), None)
    return shared if shared is not None else f"{one}-{other}"
