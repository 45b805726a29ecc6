"""One process of a swarm: its input from the command line and the environment, and its run.

A detour is the address of a relay that a process dials instead of a peer's own address. `FLOCKWIRE_DETOURS` has them,
as `gateway=127.0.0.1:40001,uav1=127.0.0.1:40002`. `flockwire up` sets it for processes whose links a file of faults
breaks or slows. A detour does not weaken security: the process that answers must have a certificate of the swarm for
that address, and has only the rights of its identity.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from flockwire_core.objects import load_object
from flockwire_core.process.cores import Core, Start, make_core
from flockwire_core.runtime.session import EndpointInUseError, Session, connect
from flockwire_core.security.files import CredentialsError
from flockwire_core.swarm.wording import printable
from flockwire_core.wire.plan import Plan

DETOURS = "FLOCKWIRE_DETOURS"
_FORM = re.compile(r"(?P<identity>[a-z0-9-]+)=(?P<address>[^\s,=]+:[0-9]{1,5})")


class DetoursError(ValueError):
    """The environment has malformed detours."""


def read_detours(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return `IP:PORT` by the dialled identity; raises DetoursError."""
    text = environment.get(DETOURS, "")
    matches = [_FORM.fullmatch(part) for part in text.split(",")] if text else []
    found = {match["identity"]: match["address"] for match in matches if match is not None}
    if len(found) < len(matches):
        raise DetoursError(f"{DETOURS} = {text!r}: must be IDENTITY=IP:PORT, several separated by commas")
    return found


def detour_environment(detours: Mapping[str, str]) -> dict[str, str]:
    """Return the environment that passes a process its `detours`, nothing when it has none."""
    return {DETOURS: ",".join(f"{identity}={address}" for identity, address in detours.items())} if detours else {}


@dataclass(frozen=True, slots=True)
class Job:
    """The input of a process; `toml` is the swarm file's text, `out` a recorder's folder, `notes` are for its trace."""

    plan: Plan
    identity: str
    keys: Path | None
    toml: str
    out: Path
    make_core: Callable[[Start], Core] = make_core
    notes: Mapping[str, str] = field(default_factory=dict)


class PrintableFormatter(logging.Formatter):
    """Formats a record as a terminal may show it: its text may come from another process, or a tracker."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the lines of `record`."""
        return printable(super().format(record))


def serve(job: Job) -> int:
    """Run the process of `job` until it must end; returns its exit status."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(PrintableFormatter("%(asctime)s.%(msecs)03d %(name)s: %(message)s", "%H:%M:%S"))
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    logging.raiseExceptions = False  # the terminal may be closed while drones fly
    run = load_object(job.plan.rows[job.identity].runner)
    try:
        asyncio.run(run(job))
    except (CredentialsError, DetoursError, EndpointInUseError) as error:
        logging.getLogger(job.identity).error(str(error))
        return 2
    except OSError as error:  # the disk is full, or not writable
        logging.getLogger(job.identity).error(str(error))
        return 1
    return 0


async def connect_job(job: Job, ended: asyncio.Event) -> Session | None:
    """Open the session of the process of `job`; None if `ended` is first.

    Raises CredentialsError, DetoursError and EndpointInUseError.
    """
    return await connect(job.plan, job.identity, job.keys, ended, read_detours())


class FileStore:
    """Keeps bytes in the file `path`, without waiting for the disk. Without its folder it keeps nothing."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer = ThreadPoolExecutor(max_workers=1)  # starts no thread before the first write

    def read(self) -> bytes:
        """Return what was written last, empty if nothing."""
        try:
            return self._path.read_bytes()
        except OSError:
            return b""

    def write(self, data: bytes) -> None:
        """Keep `data`; does not wait for it."""
        self._writer.submit(self._write, data)

    def _write(self, data: bytes) -> None:
        new = self._path.with_suffix(".new")
        if not new.parent.is_dir():
            return
        try:
            new.write_bytes(data)
            new.replace(self._path)
        except OSError as error:
            logging.getLogger(self._path.stem).warning("%s: not kept for a restart: %s", self._path, error.strerror)
