"""Counts requests of the user, or the system, to end `up`."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Iterator

from flockwire_core.runtime.ending import ending_signals

LEFT_EARLY = "left before the drones were known to be down"  # at the second interrupt


class Interrupts:
    """At the first the drones land; at the second `up` exits, and they land by themselves."""

    def __init__(self) -> None:
        self.count = 0

    def take(self, number: signal.Signals) -> None:
        """Count one signal; a closing terminal counts once for all its signals."""
        self.count = max(self.count, 1) if number is signal.SIGHUP else self.count + 1


@contextlib.contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Count the signals that end a process (ending_signals) in the running loop during the context."""
    loop, taken, signals = asyncio.get_running_loop(), Interrupts(), ending_signals()
    for number in signals:
        loop.add_signal_handler(number, taken.take, number)
    try:
        yield taken
    finally:
        for number in signals:
            loop.remove_signal_handler(number)
