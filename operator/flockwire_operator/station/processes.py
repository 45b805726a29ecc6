"""The processes of one host, as children that never outlive their parent."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
from collections.abc import AsyncIterator, Iterable, Sequence
from itertools import groupby
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.time import nanoseconds
from flockwire_core.runtime.ending import LIFELINE
from flockwire_core.runtime.session import Session
from flockwire_core.wire.processes import OPERATOR

from flockwire_operator.station.connecting import UNANSWERED, connected
from flockwire_operator.station.flown import flown, flown_by
from flockwire_operator.station.host import Host, PortInUseError, alone, busy_endpoint
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.interrupts import Interrupts

START_TIME = 10.0  # s that a process may take to be there before those that wait for it are started all the same
GRACE = 2.5  # s between the signal to end and SIGKILL
FILING = 30.0  # s for a recorder, which has a trace to complete
LANDING_TIME = 60.0  # s for processes with a flying drone, beside its descent
POLL = 0.02  # s
REFUSED = 2  # exit status of a process with a bad configuration


class Children:
    """The running processes, by identity. Their standard error goes to HOST.out/logs/IDENTITY.log.

    They outlive this object and its loop (asyncio's own subprocesses are killed when they are collected).
    """

    def __init__(self, host: Host) -> None:
        self._host = host
        self.took_off: int | None = None  # time 0 of the flight's faults, Unix ns
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._expected_exits: set[str] = set()
        self._read_end, self._write_end = os.pipe()
        (host.out / "logs").mkdir(parents=True, exist_ok=True)

    def start(self, identity: str) -> None:
        """Start the process of `identity`, unless it runs."""
        if self.runs(identity):
            return
        self._expected_exits.discard(identity)
        line = self._host.command_line(identity, self.took_off)
        added = self._host.environments.get(identity, {})
        with self.log(identity).open("ab") as log:
            self._running[identity] = subprocess.Popen(  # noqa: S603  (the command is this package's own)
                line,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=(self._read_end,),
                env={**os.environ, LIFELINE: str(self._read_end), **clock.epoch_environment(), **added},
                start_new_session=True,  # this process handles the terminal's Ctrl-C
            )

    def signal(self, identity: str, number: int) -> None:
        """Send a signal to the process of `identity`, if there is one."""
        if identity in self._running:
            self._running[identity].send_signal(number)

    def kill(self, identity: str) -> None:
        """End the process of `identity` at once; its exit is then expected."""
        self._expected_exits.add(identity)
        self.signal(identity, signal.SIGKILL)

    def log(self, identity: str) -> Path:
        """Return the log file of `identity`."""
        return self._host.out / "logs" / f"{identity}.log"

    def runs(self, identity: str) -> bool:
        """Return whether the process of `identity` runs."""
        return identity in self._running and self._running[identity].poll() is None

    def ended(self) -> tuple[str, ...]:
        """Return the processes that ended unexpectedly."""
        return tuple(i for i in self._running if not self.runs(i) and i not in self._expected_exits)

    def refused(self, identity: str) -> bool:
        """Return whether a process ended because of its configuration: a restart would fail too."""
        return self._running[identity].poll() == REFUSED

    def died(self) -> str:
        """Return a line about a process that ended unexpectedly, empty if all run."""
        return next((self.how(identity) for identity in self.ended()), "")

    def how(self, identity: str) -> str:
        """Return a line about how a process ended unexpectedly, with its last output."""
        longest_last_line = 4096  # bytes of a process's last output that are read
        with self.log(identity).open("rb") as log:  # only its end: the caller conducts a flight
            log.seek(max(0, log.seek(0, os.SEEK_END) - longest_last_line))
            lines = log.read().decode(errors="replace").strip().splitlines()
        status = self._running[identity].poll() or 0
        how = f"signal {signal.Signals(-status).name}" if status < 0 else f"exit status {status}"
        return f"{identity} ended unexpectedly ({how}){': ' + lines[-1] if lines else ''}"

    async def end(self, interrupted: Interrupts) -> None:
        """End all processes, in the order of their ranks, and wait for them; flying drones land first.

        Kills processes that do not end in time, but none with a flying drone: after a second interrupt these end by
        themselves, and so does a host without any, on which drones of other hosts may depend.
        """
        rows = self._host.plan.rows
        flyers = [identity for identity in self._running if rows[identity].flies]
        await self._end_all(flyers, interrupted)
        if (flyers or interrupted.count <= 1) and not any(map(self.runs, flyers)):
            ranked = sorted(self._running.keys() - flyers, key=lambda identity: rows[identity].rank)
            for _, others in groupby(ranked, lambda identity: rows[identity].rank):
                await self._end_all(others, Interrupts())
        self._forget()

    def _forget(self) -> None:
        """Leave the processes that keep running to themselves."""
        for process in self._running.values():
            process.returncode = process.poll() or 0  # of a process that keeps running: Popen's destructor would warn
        self._running.clear()
        for fd in (self._read_end, self._write_end):  # its closing signals the end of the station
            with contextlib.suppress(OSError):
                os.close(fd)

    async def _end_all(self, identities: Iterable[str], interrupted: Interrupts) -> None:
        await asyncio.gather(*(self._end(i, interrupted) for i in identities))

    async def _end(self, identity: str, interrupted: Interrupts) -> None:
        process, row = self._running[identity], self._host.plan.rows[identity]
        landing = LANDING_TIME + self._host.plan.swarm.climb_time
        patience = landing if row.flies else FILING if row.records else GRACE
        process.send_signal(signal.SIGCONT)  # a frozen process would not handle SIGTERM
        process.terminate()
        deadline = clock.monotonic() + nanoseconds(patience)
        while process.poll() is None and interrupted.count <= 1:
            if clock.monotonic() >= deadline:
                process.kill()
            await asyncio.sleep(POLL)


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


class UnansweredError(OSError):
    """The router did not answer; the text is what died, or that it was interrupted."""


@contextlib.asynccontextmanager
async def started(
    host: Host, identities: Sequence[str], identity: str, interrupted: Interrupts
) -> AsyncIterator[tuple[Children, Session]]:
    """Start the processes `identities` of `host`, and open the session of `identity`; all end with the context.

    Raises PortInUseError, UnansweredError, CredentialsError.
    """
    if busy := busy_endpoint(host.plan, (identity, *identities)):
        raise PortInUseError(busy)
    children = Children(host)
    try:
        for one in identities:
            children.start(one)
        session = await connected(host.plan, identity, host.keys, interrupted, hopeless=children.died)
        if session is None:
            raise UnansweredError(children.died() or UNANSWERED)
        with session:
            yield children, session
    finally:
        await children.end(interrupted)


@contextlib.asynccontextmanager
async def running(host: Host, interrupted: Interrupts) -> AsyncIterator[tuple[Children, Operator]]:
    """Run the processes of `host`, the router first, and the operator who sees them; they end with the context.

    Raises PortInUseError and OtherFlightError before any process starts, UnansweredError, CredentialsError.
    """
    with alone(host), flown(host.swarm_file, flown_by(host.plan.swarm, host.swarm_file, host.keys)):
        routers = [router for router in host.plan.routers if router in host.processes]
        async with started(host, routers, OPERATOR.kind, interrupted) as (children, session):
            operator = Operator(session)
            await start_processes(host, children, operator, interrupted)
            yield children, operator
