"""One process of a swarm: what its command line gives it, and running it to its end."""

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
    """What a process is to run; `toml` is the swarm file's text, `out` where a recorder writes to."""

    plan: Plan
    identity: str
    keys: Path | None
    toml: str
    out: Path
    faults: tuple[Fault, ...] = ()
    took_off: int | None = None  # when the flight's faults count from, Unix ns, where that is known already


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
    except OSError as error:  # the disk is full, or not to be written to
        logging.getLogger(job.identity).error(str(error))
        return 1
    return 0
