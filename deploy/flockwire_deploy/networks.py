"""The private networks of a swarm of containers: who shares one is who is linked, as far as bridges can say it.

Two processes that serve drones share a network of their own: an edge of the graph, or a drone's agent and driver. Every
other process has one that all linked to it are on.
"""

from __future__ import annotations

from ipaddress import IPv4Network
from typing import NamedTuple

from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

POOL = 30  # networks that an engine's own pools of addresses are good for
RANGE = IPv4Network("10.224.0.0/12")  # where more than that get theirs, unless the user names another
SPARE = 4  # addresses of a network that no container gets: its own, broadcast, the engine's, one that comes back


class RangeError(ValueError):
    """A range of addresses that is too small; the text is one line."""


class ContainerNetwork(NamedTuple):
    """One network: its name, who is on it, and its addresses where the engine is not to choose them."""

    name: str
    members: tuple[str, ...]
    subnet: IPv4Network | None = None


def aboard(plan: Plan) -> tuple[str, ...]:
    """Return whom containers run, in the order of the process table: all that `up` starts, and who conducts."""
    return tuple(identity for identity in plan.certified if identity in plan.started or identity == OPERATOR.kind)


def networks(plan: Plan, within: IPv4Network | None = None) -> tuple[ContainerNetwork, ...]:
    """Return the networks of those aboard, with subnets of `within`, or where they are many.

    Raises RangeError where they do not fit.
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
    """Return the network of the link between two processes, the first of which stands before the other in the table."""
    shared = next((name for name in (one, other) if plan.members[name].drone is None), None)
    return shared if shared is not None else f"{one}-{other}"
