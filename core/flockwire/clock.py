"""The only place that reads a clock."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

EPOCH = "FLOCKWIRE_EPOCH"  # Unix time at the monotonic clock's zero, ns: what the processes of one flight share
FIRST_SETTING = 60_000_000_000  # ns: a larger step forward is that of a clock that had not been set before


class SteadyClock:
    """Unix time in ns that continues at the monotonic clock's pace, whatever the wall clock is set to meanwhile.

    Else a step of the wall clock would make all that was received before look older or younger. A process that has no
    message yet follows a step forward, when it is larger than FIRST_SETTING: a host without a battery for its clock
    starts far behind the others. With an `epoch` that it shares, or once it is `settled`, it follows none.
    """

    def __init__(self, wall: Callable[[], int], monotonic: Callable[[], int], epoch: int | None = None) -> None:
        self._wall, self._monotonic = wall, monotonic
        self.epoch, self.settled = wall() - monotonic() if epoch is None else epoch, epoch is not None

    def now(self) -> int:
        """Return the time."""
        since = self._monotonic()
        if not self.settled and self._wall() - self.epoch - since >= FIRST_SETTING:
            self.epoch = self._wall() - since
        return self.epoch + since


def _shared_epoch() -> int | None:
    given = os.environ.get(EPOCH, "")
    return int(given) if given.isdecimal() else None


_IMPORTED = time.monotonic_ns()
_correction = 0  # ns that this host's clock is behind the swarm's
_STEADY = SteadyClock(time.time_ns, time.monotonic_ns, _shared_epoch())


def now() -> int:
    """Return swarm time, Unix time in ns: the time base of all stamps."""
    return _STEADY.now() + _correction


def settle() -> None:
    """Follow no step of this host's clock any more: messages are stamped from here on."""
    _STEADY.settled = True


def epoch() -> int:
    """Return the Unix time at the monotonic clock's zero by which this process counts, ns."""
    return _STEADY.epoch


def share(epoch: int) -> None:
    """Count by the `epoch` of a process of this machine that runs already, ns."""
    _STEADY.epoch, _STEADY.settled = epoch, True


def correct(correction: int) -> None:
    """Have `now` show this host's time and `correction` ns: how far it is behind the swarm's."""
    global _correction  # noqa: PLW0603  (one process, one clock)
    _correction = correction


def epoch_environment() -> dict[str, str]:
    """Return the environment by which a child, whenever it is started, has the same time as this process."""
    return {EPOCH: str(_STEADY.epoch)}


def utc() -> datetime:
    """Return the time as certificates count it."""
    return datetime.now(UTC)


def local() -> datetime:
    """Return the time as people's watches show it here: for the names of folders."""
    return datetime.now().astimezone()


def monotonic() -> int:
    """Return the monotonic clock in ns: the time base of loops."""
    return time.monotonic_ns()


def uptime() -> float:
    """Return for how long this process runs, s: since it was made (on Linux), elsewhere since this was imported."""
    try:
        fields = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        made = int(fields[19]) / os.sysconf("SC_CLK_TCK")  # proc(5): field 22, the 20th after the name
        return time.clock_gettime(time.CLOCK_BOOTTIME) - made
    except (OSError, ValueError, IndexError, AttributeError):
        return (time.monotonic_ns() - _IMPORTED) / 1e9


def cpu_time() -> float:
    """Return the processor time that this process has used, s."""
    return time.process_time()
