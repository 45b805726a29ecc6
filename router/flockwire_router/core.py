"""The router without clock, input or output: Zenoh itself passes the others' messages on."""

from __future__ import annotations

from flockwire.process.cores import Ground, Start
from flockwire.wire.phase import Phase
from flockwire.wire.status import Report


class RouterCore(Ground):
    """Reports how it is, nothing else."""

    period = 0.05  # s

    def report(self, now: int) -> Report:
        """Return how the router is."""
        return Report(Phase.ROUTING)


def make_core(_: Start) -> RouterCore:
    """Return the router's core."""
    return RouterCore()
