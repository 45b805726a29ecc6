"""Lets faults happen to real processes: signals to those of this host, in the flight's own time."""

from __future__ import annotations

import asyncio
import signal

from flockwire.faults import SIM_ONLY, Fault, Freeze, Kill, Restart
from flockwire.flight import BILLION

from flockwire_cli.processes import Children


def refusal(faults: tuple[Fault, ...]) -> str:
    """Return a line about the first fault that cannot be done to real processes, empty when all can."""
    for place, fault in enumerate(faults):
        if fault.kind in SIM_ONLY:
            return f"faults.{place}.kind = {fault.kind!r}: only `flockwire sim` can do this; a real flight cannot"
    return ""


class Misfortune:
    """The `faults` that befall the processes among `children`; times count from the first `step` in flight."""

    def __init__(self, faults: tuple[Fault, ...], here: tuple[str, ...], children: Children) -> None:
        self._due = [f for f in faults if isinstance(f, Kill | Restart | Freeze) and f.process in here]
        self._thaws: list[tuple[float, str]] = []
        self._children = children
        self._restarts: set[asyncio.Task[None]] = set()

    def step(self, since_takeoff: int) -> None:
        """Let happen what is due `since_takeoff` ns after the order to take off."""
        t = since_takeoff / BILLION
        while self._due and self._due[0].at <= t:
            self._befall(self._due.pop(0))
        for thaw in [thaw for thaw in self._thaws if thaw[0] <= t]:
            self._thaws.remove(thaw)
            self._children.signal(thaw[1], signal.SIGCONT)

    async def end(self) -> None:
        """Wait for what is under way."""
        await asyncio.gather(*self._restarts)

    def _befall(self, fault: Kill | Restart | Freeze) -> None:
        match fault:
            case Kill():
                self._children.kill(fault.process)
            case Freeze():
                self._children.signal(fault.process, signal.SIGSTOP)
                self._thaws.append((fault.at + fault.duration, fault.process))
            case Restart():
                task = asyncio.create_task(self._children.restart(fault.process))
                self._restarts.add(task)
