"""Injects faults for real, in the flight's own time: signals to processes of this host, relays on their links."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from functools import partial

from flockwire.flight.faults import SIM_ONLY, Cut, Fault, Freeze, Kill, LinkChange, Partition, Restart
from flockwire.nanoseconds import BILLION
from flockwire.wire.plan import Plan

from flockwire_cli.processes import Children
from flockwire_cli.relay import links
from flockwire_cli.relay.links import LinkFault, Relays


def refusal(faults: tuple[Fault, ...], plan: Plan, host: str) -> str:
    """Return a line about the first fault that a flight seen from `host` cannot have; empty when it can have all."""
    for place, fault in enumerate(faults):
        if fault.kind in SIM_ONLY:
            return f"faults.{place}.kind = {fault.kind!r}: only `flockwire sim` can do this; a real flight cannot"
        if isinstance(fault, LinkFault) and (line := links.refusal(place, fault, plan, host)):
            return line
    return ""


class FaultInjector:
    """The `faults` of links and of the processes `here`, among `children`; times count from the order to take off."""

    def __init__(self, faults: tuple[Fault, ...], here: tuple[str, ...], children: Children, relays: Relays) -> None:
        self._due = [
            f
            for f in faults
            if isinstance(f, LinkFault) or (isinstance(f, Kill | Restart | Freeze) and f.process in here)
        ]
        self._ends: list[tuple[float, Callable[[], None]]] = []
        self._children, self._relays = children, relays
        self._restarts: set[asyncio.Task[None]] = set()

    def step(self, since_takeoff: int) -> None:
        """Inject what is due `since_takeoff` ns after the order to take off."""
        t = since_takeoff / BILLION
        while self._due and self._due[0].at <= t:
            self._inject(self._due.pop(0))
        for end in [end for end in self._ends if end[0] <= t]:
            self._ends.remove(end)
            end[1]()

    async def end(self) -> None:
        """Wait for what is under way."""
        await asyncio.gather(*self._restarts)

    def _inject(self, fault: Kill | Restart | Freeze | LinkFault) -> None:
        match fault:
            case Kill():
                self._children.kill(fault.process)
            case Freeze():
                self._children.signal(fault.process, signal.SIGSTOP)
                thaw = partial(self._children.signal, fault.process, signal.SIGCONT)
                self._ends.append((fault.at + fault.duration, thaw))
            case Restart():
                task = asyncio.create_task(self._children.restart(fault.process))
                self._restarts.add(task)
            case Cut() | LinkChange() | Partition():
                self._ends.append((fault.at + fault.duration, self._relays.inject(fault)))
