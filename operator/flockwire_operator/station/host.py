"""One host of a swarm: the options of a flight, the command lines of its processes, its lock and ports."""

from __future__ import annotations

import errno
import socket
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from flockwire_core.locking import EXCLUSIVE, NOW, lock, opened
from flockwire_core.wire.command_line import FilePaths, arguments
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.targets import WRAPPED

from flockwire_operator.station.flown import as_flown

STILL_FLIES = (
    "{file}: processes of this swarm still run on this host; after `up` was killed they land the drones and end by "
    "themselves (`flockwire status` shows them)"
)


class PortInUseError(OSError):
    """A process of the swarm cannot listen at its endpoint."""


@dataclass(frozen=True, slots=True)
class Host:
    """One host: the swarm's plan and file, its name in [hosts], the folders of logs and of keys, the file of faults.

    `environments` has the environment variables that a process gets besides this one's, by identity.
    """

    plan: Plan
    swarm_file: Path
    name: str
    out: Path
    keys: Path
    faults_file: Path | None = None
    environments: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def processes(self) -> tuple[str, ...]:
        """The processes that run here."""
        return self.plan.processes_on(self.name)

    @property
    def conducts(self) -> bool:
        """Whether this host gives the orders, and gets the trace."""
        return self.plan.conducts(self.name)

    def command_line(self, identity: str, took_off: int | None = None) -> list[str]:
        """Return the command line that runs `identity`.

        The recorder, and processes whose cores faults wrap, get the file of faults, with their time 0 (Unix ns)
        if known.
        """
        row, paths = self.plan.rows[identity], FilePaths(str(self.swarm_file), str(self.keys), str(self.out))
        line = [sys.executable, "-P", "-m", "flockwire_operator", *arguments(self.plan, identity, paths)]
        if (row in WRAPPED or row.records) and self.faults_file is not None:
            line += ["--faults", str(self.faults_file)]
            if took_off is not None:
                line += ["--took-off", str(took_off)]
        return line


@contextmanager
def alone(host: Host) -> Iterator[None]:
    """Hold this host's lock of the swarm; raises PortInUseError where another `up` has it, or a port is in use.

    The lock is on a key of a process of this host: makers of keys and other hosts use other locks.
    """
    key = host.keys / f"{next(iter(host.processes), '')}.key"
    with opened(key) if key.exists() else nullcontext() as held:
        try:
            if held is not None:
                lock(held, EXCLUSIVE | NOW)
        except BlockingIOError:
            raise PortInUseError(f"{host.keys}: another `flockwire up` flies with these keys; end it first") from None
        if busy := busy_endpoint(host.plan, host.processes):
            flies = as_flown(host.swarm_file) is not None
            raise PortInUseError(STILL_FLIES.format(file=host.swarm_file) if flies else busy)
        yield


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
