"""From the key table and the graph to who may say and hear what, and from there to access-control rules.

Pure functions of the swarm. Every process derives its own publishers, subscriptions, links and rules from here; between
two processes both guard: what one may not say to the other, the other does not let in either.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from flockwire.keys import ROWS, Key, all_keys, key_text
from flockwire.wiring import ROUTER, identities

if TYPE_CHECKING:
    from flockwire.config import Swarm

Rule = dict[str, object]


def flows(swarm: Swarm) -> Iterator[tuple[Key, tuple[str, ...], tuple[str, ...]]]:
    """Yield every key with the identities that say it and those that hear it, in the table's order."""
    for key in all_keys(swarm):
        row = ROWS[key.kind]
        yield key, row.said_by(swarm, key.owner), row.heard_by(swarm, key.owner)


def says(swarm: Swarm, identity: str) -> tuple[Key, ...]:
    """Return the keys that `identity` publishes."""
    return tuple(key for key in all_keys(swarm) if identity in ROWS[key.kind].said_by(swarm, key.owner))


def hears(swarm: Swarm, identity: str) -> tuple[Key, ...]:
    """Return the keys that `identity` subscribes to."""
    return tuple(key for key in all_keys(swarm) if identity in ROWS[key.kind].heard_by(swarm, key.owner))


def partners(swarm: Swarm, identity: str) -> tuple[str, ...]:
    """Return the identities that `identity` exchanges at least one key with, in the order of dialling."""
    found: set[str] = set()
    for _, speakers, listeners in flows(swarm):
        if identity in speakers:
            found.update(listeners)
        if identity in listeners:
            found.update(speakers)
    return tuple(other for other in identities(swarm) if other in found and other != identity)


def links(swarm: Swarm, identity: str) -> tuple[str, ...]:
    """Return the identities that `identity` is linked to: its partners, or the router, which is linked to all."""
    if swarm.network.mode == "peers":
        return partners(swarm, identity)
    return identities(swarm)[1:] if identity == ROUTER else (ROUTER,)


def dials(swarm: Swarm, identity: str) -> tuple[str, ...]:
    """Return the linked identities that `identity` dials: those before it in the order of dialling."""
    order = identities(swarm)
    return tuple(other for other in links(swarm, identity) if order.index(other) < order.index(identity))


def passes(swarm: Swarm, sender: str, receiver: str) -> tuple[Key, ...]:
    """Return the keys that may go over the link from `sender` to `receiver`.

    Between partners: what the one says and the other hears. A router passes on what others may say.
    """
    if sender == ROUTER:
        return hears(swarm, receiver)
    if receiver == ROUTER and swarm.network.mode == "router":
        return says(swarm, sender)
    spoken = frozenset(says(swarm, sender))
    return tuple(key for key in hears(swarm, receiver) if key in spoken)


def access_control(swarm: Swarm, identity: str) -> Rule:
    """Return Zenoh's access control for the process of `identity`: what is not listed is denied, both ways.

    For each link: the samples that may leave and come in, and the subscriptions that call for them, which go the other
    way. Queries, replies, liveliness and deletions are in no rule. A router subscribes at its clients in others' name.
    """
    rules, policies, subjects = [], [], []
    for other in links(swarm, identity):
        out, back = passes(swarm, identity, other), passes(swarm, other, identity)
        granted = (
            ("says", "egress", "put", out),
            ("asked", "ingress", "declare_subscriber", out),
            ("hears", "ingress", "put", back),
            ("asks", "egress", "declare_subscriber", back),
        )
        named = [
            {
                "id": f"{other} {name}",
                "permission": "allow",
                "flows": [flow],
                "messages": [message],
                "key_exprs": [key_text(swarm, key) for key in keys],
            }
            for name, flow, message, keys in granted
            if keys
        ]
        rules += named
        subjects.append({"id": other, "cert_common_names": [other]})
        policies.append({"rules": [rule["id"] for rule in named], "subjects": [other]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }
