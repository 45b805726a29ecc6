"""Injects faults into processes, links and clocks; faulty_core.py injects all others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from flockwire_core.domain.time import nanoseconds
from flockwire_core.wire.plan import Plan

from flockwire_lab.faults.file import parse_faults
from flockwire_lab.faults.kinds import ClockStep, Fault, Freeze, Kill, LinkChange, Restart
from flockwire_lab.network import Conditions, VirtualLink
from flockwire_lab.process import VirtualProcess
from flockwire_lab.virtual_time import Action, Scheduler

RESTART_TIME = 0.5  # s that a process takes to restart


def unable(plan: Plan, key: str, fault: object) -> Iterator[str]:
    """Yield a line about a fault that virtual time does not support."""
    if isinstance(fault, Kill | Freeze | Restart | ClockStep) and fault.process in plan.routers:
        yield f"{key}.process = {fault.process!r}: does not exist in virtual time; cut or partition links instead"


def possible_faults(table: dict[str, Any], plan: Plan, origin: str, *file: type[Any]) -> tuple[Any, ...]:
    """Return the faults of `table` for virtual time as `parse_faults` does."""
    return parse_faults(table, plan, origin, partial(unable, plan), *file)


class FaultInjector:
    """The `faults` of one flight of `plan`, counted from `begin`; who dies is restarted as in a real flight."""

    def __init__(
        self,
        faults: tuple[Fault, ...],
        plan: Plan,
        scheduler: Scheduler,
        processes: Mapping[str, VirtualProcess],
        links: Mapping[tuple[str, str], VirtualLink],
    ) -> None:
        self.took_off: int | None = None  # Unix ns
        self._faults, self._plan, self._scheduler = faults, plan, scheduler
        self._processes, self._links = processes, links

    def begin(self) -> None:
        """Set time 0 to the current time."""
        self.took_off = self._scheduler.now
        for fault in self._faults:
            self._after(fault.at, self._inject, fault)

    def _inject(self, fault: Fault) -> None:
        match fault:
            case Kill() if not self._plan.rows[fault.process].restarts:
                self._processes[fault.process].kill()
            case Kill() | Restart():
                process = self._processes[fault.process]
                process.kill()
                self._after(RESTART_TIME, process.start)
            case Freeze():
                self._processes[fault.process].freeze()
                if not fault.outlasted(self._faults):
                    self._after(fault.duration, self._processes[fault.process].thaw)
            case ClockStep():
                self._processes[fault.process].clock.step(nanoseconds(fault.step))
            case _:
                self._disturb(fault)

    def _disturb(self, fault: Fault) -> None:
        """Change the links of `fault`, if it has any, for its duration."""
        by: Conditions | None = None
        if isinstance(fault, LinkChange):
            by = Conditions(fault.delay, fault.jitter, fault.loss, fault.reordering)
        for ends in fault.directions(self._plan):
            if (link := self._links.get(ends)) is not None:  # between partners messages may go one way alone
                link.disturb(by)
                self._after(fault.lasts, link.restore, by)

    def _after(self, seconds: float, action: Action, argument: object = None) -> None:
        self._scheduler.at(self._scheduler.now + nanoseconds(seconds), action, argument)
