"""`flockwire up`: all processes of this host, watched; a flight from take-off to landing; its report.

Of several hosts, the one that runs the recorder conducts the flight; the others serve until they are told to end.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import POLL_PERIOD, Director, Stage
from flockwire.flight.faults import Fault
from flockwire.nanoseconds import BILLION
from flockwire.runtime.session import Session, connect
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR
from rich.console import Console
from rich.live import Live

from flockwire_cli.fault_injection import FaultInjector
from flockwire_cli.operator import Operator
from flockwire_cli.processes import Children, PortInUseError, busy_endpoint
from flockwire_cli.relay.links import Relays
from flockwire_cli.table import Rates, draw
from flockwire_cli.verdict import unrecorded

START_TIME = 10.0  # s that a process may take to be there before those that wait for it are started all the same


@dataclass(frozen=True, slots=True)
class UpOptions:
    """What to fly: the swarm's plan and file, this host's name, s of flight, the output folder, faults."""

    plan: Plan
    swarm_file: Path
    host: str
    duration: float
    out: Path
    keys: Path
    headless: bool
    faults: tuple[Fault, ...] = ()
    faults_file: Path | None = None

    @property
    def conducts(self) -> bool:
        """Whether this host gives the orders, and gets the trace."""
        return self.plan.conducts(self.host)


async def fly(flight: UpOptions) -> str:
    """Fly; returns why the flight failed, empty when it did not. Raises PortInUseError before anything starts."""
    busy = busy_endpoint(flight.plan, flight.plan.processes_on(flight.host))
    if busy:
        raise PortInUseError(busy)
    async with Relays(flight.faults if flight.conducts else (), flight.plan) as relays:
        return await _fly(flight, relays)


async def _fly(flight: UpOptions, relays: Relays) -> str:
    here = flight.plan.processes_on(flight.host)
    children = Children(flight.plan, flight.swarm_file, flight.out, flight.keys, flight.faults_file, relays.detours)
    try:
        session = await _start(flight, children, here)
        with session:
            injector = FaultInjector(flight.faults, here, children, relays)
            try:
                return await _conduct(flight, children, Operator(flight.plan, session), injector)
            finally:
                await injector.end()
    finally:
        await children.end()


async def _start(flight: UpOptions, children: Children, here: tuple[str, ...]) -> Session:
    """Start the processes of this host, each after those it waits for; returns the operator's session."""
    plan, waiting = flight.plan, list(here)
    routers = [identity for identity in waiting if identity in plan.routers]
    for identity in routers:
        await children.start(identity)
    session = await connect(plan, OPERATOR.kind, flight.keys, asyncio.Event())
    assert session is not None  # noqa: S101  (only the event that nobody sets would make it so)
    operator = Operator(plan, session)
    waiting = [identity for identity in waiting if identity not in routers]
    deadline = clock.monotonic() + round(START_TIME * BILLION)
    while waiting:
        operator.poll()
        late = clock.monotonic() > deadline or bool(children.died())
        ready = [i for i in waiting if late or not _awaited(plan, i, here).difference(operator.statuses)]
        for identity in ready:
            await children.start(identity)
        waiting = [identity for identity in waiting if identity not in ready]
        if waiting:
            await asyncio.sleep(POLL_PERIOD)
    return session


def _awaited(plan: Plan, identity: str, here: tuple[str, ...]) -> set[str]:
    """Return the processes of this host whose status `identity` waits for before it is started."""
    return {other for other in here if plan.rows[other].kind in plan.rows[identity].after}


async def _conduct(flight: UpOptions, children: Children, operator: Operator, injector: FaultInjector) -> str:
    director = Director(flight.plan.pilots, flight.plan.swarm.frame, flight.duration, clock.now())
    display = Display(flight, director)
    died = ""
    with display.shown(), _interrupts() as interrupts:
        heeded = 0
        while director.stage is not Stage.OVER and interrupts.count < 2:
            now = operator.poll()
            died = died or children.died()
            if not flight.conducts and (died or interrupts.count):
                return died
            if died and not director.failure:
                operator.order(director.abort(died, now))
            if interrupts.count > heeded:
                heeded = interrupts.count
                operator.order(director.land(now))
            if flight.conducts:
                operator.order(director.step(operator.statuses, now))
            if director.took_off is not None:
                children.took_off = director.took_off
                injector.step(now - director.took_off)
            display.update(operator, now)
            await asyncio.sleep(POLL_PERIOD)
    return "; ".join(filter(None, (director.failure, unrecorded(flight.plan, operator.statuses))))


class Interrupts:
    """How often the user asked to end."""

    def __init__(self) -> None:
        self.count = 0


@contextlib.contextmanager
def _interrupts() -> Iterator[Interrupts]:
    """Count SIGINT and SIGTERM: at the first the drones land, at the second everything ends at once."""
    loop, interrupts = asyncio.get_running_loop(), Interrupts()

    def interrupted() -> None:
        interrupts.count += 1

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, interrupted)
    try:
        yield interrupts
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)


class Display:
    """The live table, or without a terminal one line for each new stage."""

    def __init__(self, flight: UpOptions, director: Director) -> None:
        self._flight, self._director = flight, director
        self._order = flight.plan.processes_on(flight.host)
        self._rates = Rates()
        self._console = Console()
        self._live: Live | None = None
        self._stage = ""
        self._began = clock.now()

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it for as long as the context lasts."""
        if self._flight.headless or not self._console.is_terminal:
            print(f"flockwire: {self._flight.plan.swarm.name}, {len(self._order)} processes, into {self._flight.out}")
            yield
            return
        with Live(console=self._console, refresh_per_second=4) as self._live:
            yield

    def update(self, operator: Operator, now: int) -> None:
        """Show what is known at `now`."""
        seconds = (now - self._began) / BILLION
        if self._live is not None:
            title = f"{self._flight.plan.swarm.name}: {self._director.stage}, {seconds:.0f} s   (Ctrl-C lands)"
            self._live.update(draw(title, self._order, operator.statuses, self._rates, now))
        elif self._stage != self._director.stage:
            print(f"flockwire: {seconds:5.1f} s  {self._director.stage}", flush=True)
        self._stage = self._director.stage
