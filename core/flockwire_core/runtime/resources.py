"""What this process costs, and how it is connected."""

from __future__ import annotations

import asyncio
import resource
import sys
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.process.stepping import Resources
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.runtime.session import Session


class ProcessResources:
    """What this process costs, and how it is connected.

    A caller on Zenoh's thread names the `loop` that looks at the links: to look on that thread would hand all its work
    over to another one.
    """

    def __init__(self, session: Session, refusals: Refusals, loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._session, self._refusals, self._loop = session, refusals, loop
        self._links: tuple[str, ...] = ()
        self._resident = 0
        self._look_at = 0
        self._at, self._used = clock.now(), clock.cpu_time()
        if loop is not None:
            self._look()

    def at(self, now: int) -> Resources:
        """Return those at `now` (Unix ns): the share of a core since the last call.

        The most memory that was resident, and who is linked, are as of a second or so ago: to look takes a while.
        """
        used, elapsed = clock.cpu_time(), max(1, now - self._at)
        share = (used - self._used) * SECOND / elapsed
        self._at, self._used = now, used
        if clock.monotonic() >= self._look_at:
            self._look_at = clock.monotonic() + SECOND
            if self._loop is None:
                self._look()
            else:
                self._loop.call_soon_threadsafe(self._look)
        return Resources(share, self._resident, self._refusals.count, self._links)

    def _look(self) -> None:
        self._links, self._resident = self._session.linked(), peak_memory()
        self._session.guard()


def peak_memory() -> int:
    """Return the peak resident memory of this process, in bytes.

    On Linux it is read from /proc, because getrusage(2) starts with the parent's value.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
        return int(status.partition("VmHWM:")[2].split(maxsplit=1)[0]) * 1024
    except (OSError, ValueError, IndexError):
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most if sys.platform == "darwin" else most * 1024
