"""The processes of one host, as children that never outlive their parent."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from flockwire import clock
from flockwire.domain.time import nanoseconds
from flockwire.runtime.detours import detour_environment
from flockwire.runtime.ending import LIFELINE
from flockwire.wire.plan import Plan

from flockwire_station.command_lines import FilePaths, arguments
from flockwire_station.terminal.interrupts import Interrupts

GRACE = 2.5  # s between the signal to end and SIGKILL
FILING = 30.0  # s for a recorder, which has a trace to complete
LANDING_TIME = 60.0  # s for processes with a flying drone
POLL = 0.02  # s
LONGEST_LAST_LINE = 4096  # bytes of a process's last output that are read
REFUSED = 2  # exit status of a process with a bad configuration


class PortInUseError(OSError):
    """A process of the swarm cannot listen at its endpoint."""


def command(
    plan: Plan,
    identity: str,
    swarm_file: Path,
    out: Path,
    keys: Path,
    faults: Path | None = None,
    took_off: int | None = None,
) -> list[str]:
    """Return the command line that runs `identity`.

    `faults` goes to the recorder and to processes that inject faults themselves, with their time 0 (Unix ns) if known.
    """
    row, paths = plan.rows[identity], FilePaths(str(swarm_file), str(keys), str(out))
    line = [sys.executable, "-m", "flockwire_cli", *arguments(plan, identity, paths)]
    if (row.faults or row.records) and faults is not None:
        line += ["--faults", str(faults)]
        if took_off is not None:
            line += ["--took-off", str(took_off)]
    return line


def busy_endpoint(plan: Plan, identities: Iterable[str]) -> str:
    """Return a line about the first endpoint that is in use, empty if there is none."""
    listening = [
        (name, where[name]) for name in identities for where in (plan.endpoints, plan.reserved) if name in where
    ]
    kind = socket.SOCK_DGRAM if plan.over_quic else socket.SOCK_STREAM
    for identity, endpoint in listening:
        address, _, port = endpoint.rpartition(":")
        family = socket.AF_INET6 if address.startswith("[") else socket.AF_INET
        with socket.socket(family, kind) as probe:
            if kind is socket.SOCK_STREAM:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address.strip("[]"), int(port)))
            except OSError as error:
                reason = "is in use" if error.errno == errno.EADDRINUSE else str(error.strerror).lower()
                return (
                    f"network.base_port = {plan.swarm.network.base_port}: {identity} listens at {address}:{port}, "
                    f"which {reason}; end that process or choose another base_port"
                )
    return ""


class Children:
    """The running processes, by identity. Their standard error goes to `out`/logs/IDENTITY.log.

    They outlive this object and its loop (asyncio's own subprocesses are killed when they are collected).

    `detours` has the relay addresses that a process dials, by identity.
    """

    def __init__(
        self,
        plan: Plan,
        swarm_file: Path,
        out: Path,
        keys: Path,
        faults: Path | None = None,
        detours: Mapping[str, Mapping[str, str]] | None = None,
    ) -> None:
        self._plan, self._swarm_file, self._out, self._keys, self._faults = plan, swarm_file, out, keys, faults
        self.took_off: int | None = None  # time 0 of the flight's faults, Unix ns
        self._detours = detours or {}
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._expected_exits: set[str] = set()
        self._read_end, self._write_end = os.pipe()
        (out / "logs").mkdir(parents=True, exist_ok=True)

    def start(self, identity: str) -> None:
        """Start the process of `identity`."""
        line = command(self._plan, identity, self._swarm_file, self._out, self._keys, self._faults, self.took_off)
        detours = detour_environment(self._detours.get(identity, {}))
        with self.log(identity).open("ab") as log:
            self._running[identity] = subprocess.Popen(  # noqa: S603  (the command is this package's own)
                line,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=(self._read_end,),
                env={**os.environ, LIFELINE: str(self._read_end), **clock.epoch_environment(), **detours},
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

    async def restart(self, identity: str) -> None:
        """Kill the process of `identity`, if it runs, and restart it."""
        self.kill(identity)
        if identity in self._running:
            await _exited(self._running[identity])
        self.start(identity)
        self._expected_exits.discard(identity)

    def log(self, identity: str) -> Path:
        """Return the log file of `identity`."""
        return self._out / "logs" / f"{identity}.log"

    def ended(self) -> tuple[str, ...]:
        """Return the processes that ended unexpectedly."""
        return tuple(
            identity
            for identity, process in self._running.items()
            if process.poll() is not None and identity not in self._expected_exits
        )

    def refused(self, identity: str) -> bool:
        """Return whether a process ended because of its configuration: a restart would fail too."""
        return self._running[identity].poll() == REFUSED

    def died(self) -> str:
        """Return a line about a process that ended unexpectedly, empty if all run."""
        return next((self.how(identity) for identity in self.ended()), "")

    def how(self, identity: str) -> str:
        """Return a line about how a process ended unexpectedly, with its last output."""
        with self.log(identity).open("rb") as log:  # only its end: the caller conducts a flight
            log.seek(max(0, log.seek(0, os.SEEK_END) - LONGEST_LAST_LINE))
            lines = log.read().decode(errors="replace").strip().splitlines()
        how = _how(self._running[identity].poll() or 0)
        return f"{identity} ended unexpectedly ({how}){': ' + lines[-1] if lines else ''}"

    async def end(self, interrupted: Interrupts | None = None) -> None:
        """End all processes, in the order of their ranks, and wait for them; flying drones land first.

        Kills processes that do not end in time, but none with a flying drone: after a second interrupt these end by
        themselves.
        """
        ranks = sorted({self._plan.rows[identity].rank for identity in self._running})
        flyers = {identity for identity in self._running if self._plan.rows[identity].flies}
        await asyncio.gather(*(self._end(self._running[i], LANDING_TIME, interrupted) for i in flyers))
        if all(self._running[i].poll() is not None for i in flyers):
            for rank in ranks:
                others = [i for i in self._running if self._plan.rows[i].rank == rank and i not in flyers]
                await asyncio.gather(*(self._end(self._running[i], self._grace(i), None) for i in others))
        for process in self._running.values():
            process.returncode = process.poll() or 0  # of a process that keeps running: Popen's destructor would warn
        self._running.clear()
        for fd in (self._read_end, self._write_end):  # its closing signals the end of the station
            with contextlib.suppress(OSError):
                os.close(fd)

    def _grace(self, identity: str) -> float:
        return FILING if self._plan.rows[identity].records else GRACE

    async def _end(self, process: subprocess.Popen[bytes], patience: float, interrupted: Interrupts | None) -> None:
        process.send_signal(signal.SIGCONT)  # a frozen process would not handle SIGTERM
        process.terminate()
        deadline = clock.monotonic() + nanoseconds(patience)
        while process.poll() is None and clock.monotonic() < deadline:
            if interrupted is not None and interrupted.count > 1:
                return
            await asyncio.sleep(POLL)
        process.kill()
        await _exited(process)


async def _exited(process: subprocess.Popen[bytes]) -> None:
    """Wait until a process has ended."""
    while process.poll() is None:  # noqa: ASYNC110  (nobody sets an event at a child's end)
        await asyncio.sleep(POLL)


def _how(status: int) -> str:
    return f"signal {signal.Signals(-status).name}" if status < 0 else f"exit status {status}"
