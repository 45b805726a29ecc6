"""The file of faults: one TOML file is used in real and virtual time.

    [[faults]]
    at = 12.0          # s after the order to take off
    kind = "kill"
    process = "uav3"

Times must be in order, unknown keys are refused.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

from flockwire_analysis import FAULTS
from flockwire_core.swarm.reading import read_toml
from flockwire_core.swarm.tables import Items, Model
from flockwire_core.swarm.validation import validate
from flockwire_core.swarm.wording import InputError, meant
from flockwire_core.wire.plan import Plan
from pydantic import Field

from flockwire_lab.faults.kinds import Fault
from flockwire_lab.faults.targets import targets

NOBODY = "no drone of this swarm can have it"


class _File(Model):
    faults: Items[Annotated[Fault, Field(discriminator="kind")]] = ()


def load_faults(path: Path, plan: Plan) -> tuple[Fault, ...]:
    """Read and check the faults for the swarm of `plan` in the file `path`; raises InputError."""
    return parse_faults(read_toml(path, "faults", InputError), plan, str(path))


def parse_faults(table: dict[str, object], plan: Plan, origin: str, file: type[Any] = _File) -> tuple[Any, ...]:
    """Check the content `table` of the fault file `origin`, a `file`; returns its faults. Raises InputError."""
    faults: tuple[Any, ...] = validate(file, table, origin, InputError).faults
    problems = list(_problems(faults, plan))
    if problems:
        raise InputError("\n".join(f"{origin}: {line}" for line in problems))
    return faults


def notes(faults: Sequence[Fault]) -> dict[str, str]:
    """Return what a trace's metadata says of the injected faults: s after the take-off order, and in words."""
    told = [[fault.at, f"{fault.kind} {fault.subject}".strip()] for fault in faults]
    return {FAULTS: json.dumps(told)} if told else {}


def _problems(faults: tuple[Fault, ...], plan: Plan) -> Iterator[str]:
    processes, before = targets(plan), 0.0
    for place, fault in enumerate(faults):
        key = f"faults.{place}"
        if fault.at < before:
            yield f"{key}.at = {fault.at:g}: must not be before the fault above, at {before:g}"
        before = max(before, fault.at)
        for name, process in fault.named_processes().items():
            if process not in processes:
                choice = f"{', '.join(processes)}{meant(process, processes)}"
                yield f"{key}.{name} = {process!r}: there is no such process; must be one of {choice}"
        known = fault.possible(plan)
        for name, number in fault.named_drones().items():
            if number not in known:
                spared = f"{fault.kind} cannot happen to it, by its airframe or part"
                rule = spared if number in plan.pilot else "there is no such drone"
                must = f"must be one of {list(known)}" if known else NOBODY
                yield f"{key}.{name} = {number}: {rule}; {must}"
        for name, problem in fault.problems(plan):
            yield f"{key}.{name} = {problem}"
