"""`flockwire up`: all processes of this host, watched; a flight from take-off to landing; its report.

Of several hosts, the one that runs the recorder conducts the flight; the others serve until they are to end. What
flies outlives this station: when it is gone, pilots land, and their processes end when the drones are down.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from flockwire import clock
from flockwire.domain.time import nanoseconds
from flockwire.process.faults import Fault
from flockwire.runtime.session import Session
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR
from flockwire_relay.links import Relays

from flockwire_station.conduct import at_terminal
from flockwire_station.connecting import UNANSWERED, connected
from flockwire_station.fault_injection import FaultInjector
from flockwire_station.flown import flown, flown_by
from flockwire_station.operator import Operator
from flockwire_station.processes import Children, PortInUseError, Restarts, busy_endpoint
from flockwire_station.terminal.display import Display
from flockwire_station.terminal.interrupts import Interrupts, interrupts
from flockwire_station.verdict import disk_full

START_TIME = 10.0  # s that a process may take to be there before those that wait for it are started all the same
LEFT = "left before the drones were known to be down: they land by themselves, the recorder ends last"


@dataclass(frozen=True, slots=True)
class UpOptions:
    """What to fly: the swarm's plan and file, this host's name, s of flight, the folder, faults, who stays down."""

    plan: Plan
    swarm_file: Path
    host: str
    duration: float
    out: Path
    keys: Path
    headless: bool
    faults: tuple[Fault, ...] = ()
    faults_file: Path | None = None
    without: tuple[int, ...] = ()

    @property
    def conducts(self) -> bool:
        """Whether this host gives the orders, and gets the trace."""
        return self.plan.conducts(self.host)


async def fly(flight: UpOptions) -> str:
    """Fly; returns why the flight failed, empty when it did not.

    Raises PortInUseError and OtherFlightError before anything starts.
    """
    with alone(flight):
        busy = busy_endpoint(flight.plan, flight.plan.processes_on(flight.host))
        if busy:
            raise PortInUseError(busy)
        with flown(flight.swarm_file, flown_by(flight.plan.swarm, flight.swarm_file, flight.keys)):
            async with Relays(flight.faults if flight.conducts else (), flight.plan) as relays:
                return await _fly(flight, relays)


@contextmanager
def alone(flight: UpOptions) -> Iterator[None]:
    """Hold this host's lock of the swarm; raises PortInUseError where another `up` has it.

    It is on a key of a process of this host: whoever makes keys, or flies as another host, locks something else.
    """
    first = next(iter(flight.plan.processes_on(flight.host)), "")
    held = flight.keys / f"{first}.key"
    lock = os.open(held, os.O_RDONLY) if held.exists() else -1
    try:
        if lock >= 0:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise PortInUseError(f"{flight.keys}: another `flockwire up` flies with these keys; end it first") from None
    finally:
        if lock >= 0:
            os.close(lock)


async def _fly(flight: UpOptions, relays: Relays) -> str:
    here = flight.plan.processes_on(flight.host)
    children = Children(flight.plan, flight.swarm_file, flight.out, flight.keys, flight.faults_file, relays.detours)
    with interrupts() as interrupted:
        try:
            session = await open_session(flight, children, here, interrupted)
            if session is None:
                return children.died() or UNANSWERED
            with session:
                operator = Operator(flight.plan, session)
                await start_processes(flight, children, here, operator, interrupted)
                injector = FaultInjector(flight.faults, flight.plan, here, children, relays)
                station = Station(flight, children, operator, injector)
                try:
                    return await station.conduct(interrupted)
                finally:
                    await injector.end()
                    await station.end()
        finally:
            await children.end(interrupted)


async def open_session(
    flight: UpOptions, children: Children, here: tuple[str, ...], interrupted: Interrupts
) -> Session | None:
    """Start this host's router, where it has one; returns the operator's session.

    None when interrupted, or when the router died, before the router answered.
    """
    for router in flight.plan.routers:
        if router in here:
            children.start(router)
    return await connected(flight.plan, OPERATOR.kind, flight.keys, interrupted, hopeless=children.died)


async def start_processes(
    flight: UpOptions, children: Children, here: tuple[str, ...], operator: Operator, interrupted: Interrupts
) -> None:
    """Start the other processes of this host, each after those it waits for."""
    plan = flight.plan
    waiting = [identity for identity in here if identity not in plan.routers]
    deadline = clock.monotonic() + nanoseconds(START_TIME)

    def turn(_: int) -> bool | None:
        late = clock.monotonic() > deadline or bool(children.died())
        for identity in tuple(waiting):
            if not interrupted.count and (late or not _awaited(plan, identity, here).difference(operator.statuses)):
                children.start(identity)
                waiting.remove(identity)
        return bool(interrupted.count) or not waiting or None

    await operator.run(turn)


def _awaited(plan: Plan, identity: str, here: tuple[str, ...]) -> set[str]:
    """Return the processes of this host whose status `identity` waits for before it is started."""
    return {other for other in here if plan.rows[other].kind in plan.rows[identity].after}


class Station:
    """One flight of this host's processes: faults, processes that die, and the terminal."""

    def __init__(self, flight: UpOptions, children: Children, operator: Operator, injector: FaultInjector) -> None:
        plan = flight.plan
        self._flight, self._children, self._operator, self._injector = flight, children, operator, injector
        if flight.conducts:
            operator.conduct(flight.duration, flight.without)
        self._display = Display(plan, plan.processes_on(flight.host), flight.headless)
        self._restarts = Restarts(plan, children, self._display.note)

    async def conduct(self, interrupted: Interrupts) -> str:
        """Fly from take-off to landing; returns why the flight failed, empty when it did not."""
        self._display.begin(self._flight.out)
        failure = await at_terminal(self._operator, self._display, interrupted, LEFT, self._look_after)
        unrecorded = disk_full(self._flight.plan, self._operator.statuses) if self._flight.conducts else ""
        return "; ".join(filter(None, (failure, unrecorded)))

    async def end(self) -> None:
        """Wait for what is under way."""
        await self._restarts.end()

    def _look_after(self, now: int) -> str:
        """Inject faults, start again what died; returns a line about what died for good."""
        director = self._operator.core.director
        if director is not None and director.took_off is not None:
            self._children.took_off = director.took_off
            self._injector.step(now - director.took_off)
        return self._restarts.step()
