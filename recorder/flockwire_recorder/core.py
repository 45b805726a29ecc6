"""The recorder in virtual time: it only reports, for the world itself writes the trace."""

from __future__ import annotations

from flockwire.flight.cores import Start
from flockwire.wire.keys import Key
from flockwire.wire.messages import Message
from flockwire.wire.status import Report

PERIOD = 0.02  # s


class RecorderCore:
    """Reports that it records."""

    period = PERIOD

    def __init__(self) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt: frozenset[Key] = frozenset()

    def receive(self, _: Key, __: Message, ___: int) -> None:
        """Take nothing in."""

    def due(self, _: Key) -> bool:
        """Return False."""
        return False

    def step(self, _: int) -> list[tuple[Key, Message]]:
        """Publish nothing."""
        return []

    def report(self, _: int) -> Report:
        """Return that it records."""
        return Report("recording")


def make_core(_: Start) -> RecorderCore:
    """Return the recorder's twin."""
    return RecorderCore()
