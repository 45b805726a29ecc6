"""The router without clock, input or output: Zenoh itself passes the others' messages on."""

from __future__ import annotations

from collections.abc import Iterable

from flockwire.flight.cores import Start
from flockwire.wire.keys import Key
from flockwire.wire.messages import Message
from flockwire.wire.status import Report


class RouterCore:
    """Reports how it is, nothing else."""

    period = 0.05  # s

    def __init__(self) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt: frozenset[Key] = frozenset()

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take nothing in: the router subscribes to no key."""

    def due(self, key: Key) -> bool:
        """Return False: nothing calls for a step but the rate."""
        return False

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Publish nothing of its own."""
        return ()

    def report(self, now: int) -> Report:
        """Return how the router is."""
        return Report("routing")


def make_core(_: Start) -> RouterCore:
    """Return the router's core."""
    return RouterCore()
