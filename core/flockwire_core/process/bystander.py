"""The core of a process that only reports: Zenoh passes the router's messages on, the shell of a recorder records."""

from __future__ import annotations

from flockwire_core.process.cores import Ground, Start
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report


class Bystander(Ground):
    """Reports its `phase`."""

    def __init__(self, phase: Phase, period: float) -> None:
        self.period, self._phase = period, phase  # s

    def report(self, now: int) -> Report:
        """Return its phase."""
        return Report(self._phase)


def make_router(_: Start) -> Bystander:
    """Return the router's core."""
    return Bystander(Phase.ROUTING, 0.05)


def make_recorder(_: Start | None = None) -> Bystander:
    """Return the recorder's core; in virtual time the world writes the trace."""
    return Bystander(Phase.RECORDING, 0.02)
