"""The recorder in virtual time: it only reports; the world writes the trace."""

from __future__ import annotations

from flockwire_core.process.cores import Ground, Start
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

PERIOD = 0.02  # s


class RecorderCore(Ground):
    """Reports that it records."""

    period = PERIOD

    def report(self, now: int) -> Report:
        """Return that it records."""
        return Report(Phase.RECORDING)


def make_core(_: Start) -> RecorderCore:
    """Return the recorder's core."""
    return RecorderCore()
