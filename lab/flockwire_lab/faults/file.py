"""The file of faults: one TOML file is used in real and virtual time.

    [[faults]]
    at = 12.0          # s after the order to take off
    kind = "kill"
    process = "uav3"

Times must be in order, unknown keys are refused.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
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
Unable = Callable[[str, Any], Iterable[str]]  # lines of what a flight cannot inject of a fault, by its key


class _File(Model):
    faults: Items[Annotated[Fault, Field(discriminator="kind")]] = ()


def load_faults(path: Path, plan: Plan, unable: Unable = lambda *_: ()) -> tuple[Fault, ...]:
    """Read and check the faults in the file `path` as `parse_faults` does."""
    return parse_faults(read_toml(path, "faults", InputError), plan, str(path), unable)


def parse_faults(
    table: dict[str, object], plan: Plan, origin: str, unable: Unable = lambda *_: (), file: type[Any] = _File
) -> tuple[Any, ...]:
    """Check the content `table` of the fault file `origin`, a `file`, for the swarm of `plan`; returns its faults.

    Raises InputError with a line for each problem, also for what `unable` says of a fault.
    """
    faults, lines = list[tuple[int, Any]](), list[str]()
    try:
        faults += enumerate(validate(file, table, origin, InputError).faults)
    except InputError as error:
        lines.append(str(error))
        faults += _legible(table, file)
    lines += [f"{origin}: {line}" for line in _problems(faults, plan, unable)]
    if lines:
        raise InputError("\n".join(lines))
    return tuple(fault for _, fault in faults)


def _legible(table: dict[str, object], file: type[Any]) -> Iterator[tuple[int, Any]]:
    """Yield the faults, with their places, that can be read alone."""
    given = table.get("faults")
    for place, one in enumerate(given if isinstance(given, list) else ()):
        with suppress(InputError):
            yield place, validate(file, {"faults": [one]}, "", InputError).faults[0]


def notes(faults: Sequence[Fault]) -> dict[str, str]:
    """Return what a trace's metadata says of the injected faults: s after the take-off order, and in words."""
    told = [[fault.at, f"{fault.kind} {fault.subject}".strip()] for fault in faults]
    return {FAULTS: json.dumps(told)} if told else {}


def _problems(faults: Sequence[tuple[int, Fault]], plan: Plan, unable: Unable) -> Iterator[str]:
    before = 0.0
    for place, fault in faults:
        key = f"faults.{place}"
        if fault.at < before:
            yield f"{key}.at = {fault.at:g}: must not be before the fault above, at {before:g}"
        before = max(before, fault.at)
        yield from list(_of_one(key, fault, plan)) or unable(key, fault)


def _of_one(key: str, fault: Fault, plan: Plan) -> Iterator[str]:
    """Yield what is wrong with a fault in this swarm."""
    processes, known = targets(plan), fault.possible(plan)
    for name, process in fault.named_processes().items():
        if process not in processes:
            choice = f"{', '.join(processes)}{meant(process, processes)}"
            yield f"{key}.{name} = {process!r}: there is no such process; must be one of {choice}"
    for name, number in fault.named_drones().items():
        if number not in known:
            spared = f"{fault.kind} cannot happen to it, by its airframe, part or law"
            rule = spared if number in plan.pilot else "there is no such drone"
            must = f"must be one of {list(known)}" if known else NOBODY
            yield f"{key}.{name} = {number}: {rule}; {must}"
    for name, problem in fault.problems(plan):
        yield f"{key}.{name} = {problem}"
