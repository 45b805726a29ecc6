"""The processes of one host while they run: alone with its keys, the router first, each after those it waits for."""

from __future__ import annotations

import fcntl
import os
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from flockwire import clock
from flockwire.domain.time import nanoseconds
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_station.connecting import UNANSWERED, connected
from flockwire_station.flown import flown, flown_by
from flockwire_station.operator import Operator
from flockwire_station.processes import Children, PortInUseError, busy_endpoint
from flockwire_station.terminal.interrupts import Interrupts

START_TIME = 10.0  # s that a process may take to be there before those that wait for it are started all the same


@dataclass(frozen=True, slots=True)
class Host:
    """One host: the swarm's plan and file, its name in [hosts], the folders of logs and of keys, the file of faults."""

    plan: Plan
    swarm_file: Path
    name: str
    out: Path
    keys: Path
    faults_file: Path | None = None

    @property
    def processes(self) -> tuple[str, ...]:
        """The processes that run here."""
        return self.plan.processes_on(self.name)

    @property
    def conducts(self) -> bool:
        """Whether this host gives the orders, and gets the trace."""
        return self.plan.conducts(self.name)


class Running(NamedTuple):
    """The processes that run, and the operator who sees them."""

    children: Children
    operator: Operator


class UnansweredError(RuntimeError):
    """The router did not answer; the text is what died, or that it was interrupted."""


@contextmanager
def alone(host: Host) -> Iterator[None]:
    """Hold this host's lock of the swarm; raises PortInUseError where another `up` has it, or a port is in use.

    The lock is on a key of a process of this host: makers of keys and other hosts use other locks.
    """
    held = host.keys / f"{next(iter(host.processes), '')}.key"
    lock = os.open(held, os.O_RDONLY) if held.exists() else -1
    try:
        if lock >= 0:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if busy := busy_endpoint(host.plan, host.processes):
            raise PortInUseError(busy)
        yield
    except BlockingIOError:
        raise PortInUseError(f"{host.keys}: another `flockwire up` flies with these keys; end it first") from None
    finally:
        if lock >= 0:
            os.close(lock)


@asynccontextmanager
async def running(
    host: Host, interrupted: Interrupts, detours: Mapping[str, Mapping[str, str]] | None = None
) -> AsyncIterator[Running]:
    """Run the processes of `host`; they end with the context. `detours` are those of Children.

    Raises PortInUseError and OtherFlightError before any process starts, UnansweredError, CredentialsError.
    """
    with alone(host), flown(host.swarm_file, flown_by(host.plan.swarm, host.swarm_file, host.keys)):
        children = Children(host.plan, host.swarm_file, host.out, host.keys, host.faults_file, detours)
        try:
            for router in host.plan.routers:
                if router in host.processes:
                    children.start(router)
            session = await connected(host.plan, OPERATOR.kind, host.keys, interrupted, hopeless=children.died)
            if session is None:
                raise UnansweredError(children.died() or UNANSWERED)
            with session:
                operator = Operator(host.plan, session)
                await start_processes(host, children, operator, interrupted)
                yield Running(children, operator)
        finally:
            await children.end(interrupted)


async def start_processes(host: Host, children: Children, operator: Operator, interrupted: Interrupts) -> None:
    """Start the processes but the router, each after those it waits for."""
    rows = host.plan.rows
    waiting = [identity for identity in host.processes if identity not in host.plan.routers]
    deadline = clock.monotonic() + nanoseconds(START_TIME)

    def is_due(identity: str) -> bool:
        awaited = {other for other in host.processes if rows[other].kind in rows[identity].after}
        return clock.monotonic() > deadline or bool(children.died()) or awaited <= operator.statuses.keys()

    def turn(_: int) -> bool | None:
        for identity in tuple(waiting):
            if not interrupted.count and is_due(identity):
                children.start(identity)
                waiting.remove(identity)
        return bool(interrupted.count) or not waiting or None

    await operator.run(turn)
