"""One process of a swarm: its input from the command line, and its run."""

from __future__ import annotations

import asyncio
import logging
import sys
from dataclasses import dataclass
from pathlib import Path

from flockwire.objects import load_object
from flockwire.process.faults import Fault
from flockwire.runtime.detours import DetoursError
from flockwire.runtime.session import EndpointInUseError
from flockwire.security.files import CredentialsError
from flockwire.wire.plan import Plan


@dataclass(frozen=True, slots=True)
class Job:
    """The input of a process; `toml` is the swarm file's text, `out` a recorder's folder."""

    plan: Plan
    identity: str
    keys: Path | None
    toml: str
    out: Path
    faults: tuple[Fault, ...] = ()
    took_off: int | None = None  # time 0 of the flight's faults, Unix ns, if known


def serve(job: Job) -> int:
    """Run the process of `job` until it must end; returns its exit status."""
    logging.basicConfig(
        level=logging.INFO,
        format="%(asctime)s.%(msecs)03d %(name)s: %(message)s",
        datefmt="%H:%M:%S",
        stream=sys.stderr,
    )
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
