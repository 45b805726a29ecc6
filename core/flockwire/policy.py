"""From the key table and the graph to who may say what, who may hear what, and who must therefore be linked.

Pure functions of the swarm: every process derives its own publishers, subscriptions and links from here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from flockwire.keys import ROWS, Key, all_keys
from flockwire.wiring import identities

if TYPE_CHECKING:
    from flockwire.config import Swarm


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


def links(swarm: Swarm, identity: str) -> tuple[str, ...]:
    """Return the identities that `identity` exchanges at least one key with, in the order of dialling."""
    partners: set[str] = set()
    for _, speakers, listeners in flows(swarm):
        if identity in speakers:
            partners.update(listeners)
        if identity in listeners:
            partners.update(speakers)
    return tuple(other for other in identities(swarm) if other in partners and other != identity)


def dials(swarm: Swarm, identity: str) -> tuple[str, ...]:
    """Return the linked identities that `identity` dials: those before it in the order of dialling."""
    order = identities(swarm)
    return tuple(other for other in links(swarm, identity) if order.index(other) < order.index(identity))
