"""The router of router mode: for networks in which the drones cannot reach each other."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from flockwire.config import Swarm
from flockwire.keys import Key
from flockwire.messages import Message
from flockwire.runtime import run_core
from flockwire.status import Report
from flockwire.wiring import ROUTER


class RouterCore:
    """Says how it is, nothing else: Zenoh itself passes the others' messages on."""

    trigger = None
    period = 0.05  # s

    def __init__(self) -> None:
        self.prompt: frozenset[Key] = frozenset()

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Hear nothing: the router subscribes to no key."""

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Say nothing of its own."""
        return ()

    def report(self, now: int) -> Report:
        """Return how the router is."""
        return Report("routing")


async def run(swarm: Swarm, keys: Path | None) -> None:
    """Route until the process is told to end."""
    await run_core(RouterCore(), swarm, ROUTER, keys)
