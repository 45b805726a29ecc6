"""One process of a swarm: its input from the command line, and its run."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from flockwire_core.objects import load_object
from flockwire_core.process.cores import Core, Start, make_core
from flockwire_core.runtime.detours import DetoursError, read_detours
from flockwire_core.runtime.session import EndpointInUseError, Session, connect
from flockwire_core.security.files import CredentialsError
from flockwire_core.swarm.wording import printable
from flockwire_core.wire.plan import Plan


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
