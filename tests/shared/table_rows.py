"""The key table as tests read it: who publishes and who receives each key of a swarm, not by way of a plan."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from flockwire_core.wire.keys import TABLE, Delivery, Key
from flockwire_core.wire.processes import Roster

if TYPE_CHECKING:
    from flockwire_core.swarm.model import Swarm

RECORDER = "recorder"
BATCHING = ("gateway", "kinematics", "leader", "uav", "driver")  # how their identities begin


def batched(key: Key, publishers: set[str]) -> bool:
    """Return whether the recorder receives `key` in batches and not as it is."""
    row = next(row for row in TABLE if row.kind == key.kind)
    return row.delivery is Delivery.STATE and all(name.startswith(BATCHING) for name in publishers)


def table_rows(swarm: Swarm) -> Iterator[tuple[Key, set[str], set[str]]]:
    """Yield each key with who publishes it and who subscribes to it by its row, and the recorder."""
    roster = Roster(swarm)
    for row in TABLE:
        for owner in row.owners(roster):
            key, publishers = Key(row.kind, owner.identity), set(row.publishers(roster, owner))
            recorders = set() if batched(key, publishers) else {RECORDER}
            yield key, publishers, {*row.subscribers(roster, owner), *recorders}
