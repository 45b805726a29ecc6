"""The only place that reads a clock."""

from __future__ import annotations

import time
from datetime import UTC, datetime


def now() -> int:
    """Return Unix time in ns: the time base of all stamps, shared by the processes of one machine."""
    return time.time_ns()


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
