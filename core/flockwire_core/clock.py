"""The only place that reads a clock."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

EPOCH = "FLOCKWIRE_EPOCH"  # Unix time at the monotonic clock's zero, ns, shared by the processes of one flight
FIRST_SETTING: Final = 60_000_000_000  # ns: a larger step forward is a clock's first setting


class SteadyClock:
    """Unix time in ns that follows the monotonic clock and ignores settings of the wall clock.

    Otherwise a step of the wall clock would change the ages of received messages. A process without a message yet
    follows a step forward larger than FIRST_SETTING: a host without a clock battery starts far behind the others. With
    a shared `epoch`, or after `settle`, it follows no step.
    """

    def __init__(self, wall: Callable[[], int], monotonic: Callable[[], int], epoch: int | None = None) -> None:
        self._wall, self._monotonic = wall, monotonic
        self.epoch, self.settled = wall() - monotonic() if epoch is None else epoch, epoch is not None
        self.correction = 0  # ns, lag of this host's clock behind the swarm's

    def now(self) -> int:
        """Return the time."""
        since = self._monotonic()
        if not self.settled and self._wall() - self.epoch - since >= FIRST_SETTING:
            self.epoch = self._wall() - since
        return self.epoch + since


def _shared_epoch() -> int | None:
    given = os.environ.get(EPOCH, "")
    return int(given) if given.removeprefix("-").isdecimal() else None  # it is negative early in 1970


_IMPORTED = time.monotonic_ns()
_STEADY: Final = SteadyClock(time.time_ns, time.monotonic_ns, _shared_epoch())


def now() -> int:
    """Return swarm time, Unix time in ns: the time base of all stamps."""
    return _STEADY.now() + _STEADY.correction


def settle() -> None:
    """Ignore later steps of this host's clock: messages are stamped from now on."""
    _STEADY.settled = True


def epoch() -> int:
    """Return this process's Unix time at the monotonic clock's zero, ns."""
    return _STEADY.epoch


def share(epoch: int) -> None:
    """Use the `epoch`, ns, of a running process of this machine."""
    _STEADY.epoch, _STEADY.settled = epoch, True


def correct(correction: int) -> None:
    """Add `correction` ns, the host's lag behind the swarm, to `now`."""
    _STEADY.correction = correction


def epoch_environment() -> dict[str, str]:
    """Return the environment that gives a child the same time as this process."""
    return {EPOCH: str(_STEADY.epoch)}


def utc() -> datetime:
    """Return the UTC time of certificates."""
    return datetime.now(UTC)


def local() -> datetime:
    """Return the local time, for the names of folders."""
    return datetime.now().astimezone()


def monotonic() -> int:
    """Return the monotonic clock in ns: the time base of loops."""
    return time.monotonic_ns()


def uptime() -> float:
    """Return the age of this process, s: since its start (on Linux), elsewhere since the import of this module."""
    try:
        fields = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        made = int(fields[19]) / os.sysconf("SC_CLK_TCK")  # proc(5): field 22, the 20th after the name
        return time.clock_gettime(time.CLOCK_BOOTTIME) - made
    except (OSError, ValueError, IndexError, AttributeError):
        return (time.monotonic_ns() - _IMPORTED) / 1e9


def cpu_time() -> float:
    """Return the processor time that this process has used, s."""
    return time.process_time()
