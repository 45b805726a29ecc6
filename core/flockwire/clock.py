"""The only place that reads a clock."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from datetime import UTC, datetime

EPOCH = "FLOCKWIRE_EPOCH"  # Unix time at the monotonic clock's zero, ns: what the processes of one flight share
FIRST_SETTING = 60_000_000_000  # ns: a larger step forward is that of a clock that had not been set before


class SteadyClock:
    """Unix time in ns that goes on at the monotonic clock's pace, whatever the wall clock is set to meanwhile.

    Else a step of the wall clock would make all that was received before look older or younger. It is followed only
    forward, when it is larger than FIRST_SETTING: a host without a battery for its clock starts far behind the others.
    The time never goes back.
    """

    def __init__(self, wall: Callable[[], int], monotonic: Callable[[], int], epoch: int | None = None) -> None:
        self._wall, self._monotonic = wall, monotonic
        self.epoch = wall() - monotonic() if epoch is None else epoch

    def now(self) -> int:
        """Return the time."""
        since, wall = self._monotonic(), self._wall()
        if wall - self.epoch - since >= FIRST_SETTING:
            self.epoch = wall - since
        return self.epoch + since


def _shared_epoch() -> int | None:
    given = os.environ.get(EPOCH, "")
    return int(given) if given.isdecimal() else None


_correction = 0  # ns that this host's clock is behind the swarm's
_STEADY = SteadyClock(time.time_ns, time.monotonic_ns, _shared_epoch())


def now() -> int:
    """Return swarm time, Unix time in ns: the time base of all stamps."""
    return _STEADY.now() + _correction


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


def cpu_time() -> float:
    """Return the processor time that this process has used, s."""
    return time.process_time()
