"""`flockwire up`: all processes of this host, watched; a flight from take-off to landing; its report.

Of several hosts, the one that runs the recorder conducts the flight; the others serve until they are to end. What
flies outlives this station: when it is gone, pilots land, and their processes end when the drones are down.
"""

from __future__ import annotations

import asyncio
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import POLL_PERIOD, Director, Stage
from flockwire.flight.faults import Fault
from flockwire.flight.preflight import Preflight
from flockwire.nanoseconds import BILLION
from flockwire.runtime.session import Session
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_cli.connecting import UNANSWERED, connected
from flockwire_cli.display import Display
from flockwire_cli.fault_injection import FaultInjector
from flockwire_cli.interrupts import Interrupts, interrupts
from flockwire_cli.key_orders import KeyOrders
from flockwire_cli.keyboard import Keyboard, keys_pressed
from flockwire_cli.operator import Operator
from flockwire_cli.processes import Children, PortInUseError, busy_endpoint
from flockwire_cli.relay.links import Relays
from flockwire_cli.restarting import Restarts
from flockwire_cli.verdict import disk_full

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
    """Fly; returns why the flight failed, empty when it did not. Raises PortInUseError before anything starts."""
    with alone(flight):
        busy = busy_endpoint(flight.plan, flight.plan.processes_on(flight.host))
        if busy:
            raise PortInUseError(busy)
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
    deadline = clock.monotonic() + round(START_TIME * BILLION)
    while waiting and not interrupted.count:
        operator.poll()
        late = clock.monotonic() > deadline or bool(children.died())
        ready = [i for i in waiting if late or not _awaited(plan, i, here).difference(operator.statuses)]
        for identity in ready:
            children.start(identity)
        waiting = [identity for identity in waiting if identity not in ready]
        if waiting:
            await asyncio.sleep(POLL_PERIOD)


def _awaited(plan: Plan, identity: str, here: tuple[str, ...]) -> set[str]:
    """Return the processes of this host whose status `identity` waits for before it is started."""
    return {other for other in here if plan.rows[other].kind in plan.rows[identity].after}


class Station:
    """Conducts one flight: time, faults, the user's keys and interrupts, processes that die."""

    def __init__(self, flight: UpOptions, children: Children, operator: Operator, injector: FaultInjector) -> None:
        plan = flight.plan
        self._flight, self._children, self._operator, self._injector = flight, children, operator, injector
        self._director = Director(
            plan.pilots,
            plan.swarm.frame,
            flight.duration,
            clock.now(),
            preflight=Preflight.of(plan.swarm),
            without=flight.without,
        )
        conducting = self._director if flight.conducts else None
        self._display = Display(plan, plan.processes_on(flight.host), conducting, flight.headless)
        self._orders = KeyOrders(plan, operator, conducting, self._display.note)
        self._restarts = Restarts(plan, children, self._display.note)

    async def conduct(self, interrupted: Interrupts) -> str:
        """Fly from take-off to landing; returns why the flight failed, empty when it did not."""
        director, heeded, died = self._director, 0, ""
        self._display.begin(self._flight.out)
        with self._display.shown(), keys_pressed(Keyboard(self._orders.give)):
            while director.stage is not Stage.OVER:
                now = self._operator.poll()
                died = self._restarts.step() or died
                if not self._flight.conducts and (died or interrupted.count):
                    return died
                if interrupted.count > 1:
                    return director.failure or LEFT
                if died and not director.failure:
                    self._operator.order(director.abort(died, now))
                if interrupted.count > heeded:
                    heeded = interrupted.count
                    self._operator.order(director.land(now))
                self._step(now)
                await asyncio.sleep(POLL_PERIOD)
        unrecorded = disk_full(self._flight.plan, self._operator.statuses)
        return "; ".join(filter(None, (director.failure, unrecorded)))

    async def end(self) -> None:
        """Wait for what is under way; orders are repeated no more."""
        self._orders.end()
        await self._restarts.end()

    def _step(self, now: int) -> None:
        director, operator = self._director, self._operator
        if self._flight.conducts:
            operator.order(director.step(operator.statuses, operator.telemetry, now))
        self._orders.repeat(now)
        if director.took_off is not None:
            self._children.took_off = director.took_off
            self._injector.step(now - director.took_off)
        self._display.update(operator, now)
