"""The router's core: Zenoh itself passes the messages on."""

from __future__ import annotations

from flockwire_core.process.cores import Ground, Start
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report


class RouterCore(Ground):
    """Reports only its status."""

    period = 0.05  # s

    def report(self, now: int) -> Report:
        """Return the router's status."""
        return Report(Phase.ROUTING)


def make_core(_: Start) -> RouterCore:
    """Return the router's core."""
    return RouterCore()
