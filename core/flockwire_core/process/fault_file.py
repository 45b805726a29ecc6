"""The file of faults: one TOML file is used in real and virtual time.

    [[faults]]
    at = 12.0          # s after the order to take off
    kind = "kill"
    process = "uav3"

Times must be in order, unknown keys are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import Field

from flockwire_core.process.faults import (
    AgentFault,
    AirframeFault,
    ClockStep,
    Cut,
    FalseHeight,
    Fault,
    Freeze,
    Kill,
    LinkChange,
    NameSwap,
    OfDrone,
    Partition,
    Restart,
)
from flockwire_core.swarm.reading import read_toml
from flockwire_core.swarm.tables import Items, Model
from flockwire_core.swarm.validation import validate
from flockwire_core.swarm.wording import meant
from flockwire_core.wire.plan import Plan


class FaultFileError(ValueError):
    """A bad fault file; each line of the text names one key, its value and the rule."""


class _File(Model):
    faults: Items[Annotated[Fault, Field(discriminator="kind")]] = ()


def load_faults(path: Path, plan: Plan) -> tuple[Fault, ...]:
    """Read and check the faults for the swarm of `plan` in the file `path`; raises FaultFileError."""
    return parse_faults(read_toml(path, "faults", FaultFileError), plan, str(path))


def parse_faults(table: dict[str, object], plan: Plan, origin: str) -> tuple[Fault, ...]:
    """Check the content `table` of the fault file `origin`; raises FaultFileError."""
    faults = validate(_File, table, origin, FaultFileError).faults
    problems = list(_problems(faults, plan))
    if problems:
        raise FaultFileError("\n".join(f"{origin}: {line}" for line in problems))
    return faults


def _problems(faults: tuple[Fault, ...], plan: Plan) -> Iterator[str]:
    processes = [identity for identity in plan.identities if identity not in plan.fault_exempt]
    before = 0.0
    for place, fault in enumerate(faults):
        key = f"faults.{place}"
        if fault.at < before:
            yield f"{key}.at = {fault.at:g}: must not be before the fault above, at {before:g}"
        before = max(before, fault.at)
        for name, process in _named(fault):
            if process not in processes:
                choice = f"{', '.join(processes)}{meant(process, processes)}"
                yield f"{key}.{name} = {process!r}: there is no such process; must be one of {choice}"
        for name, number in _drones(fault):
            known = _possible(fault, plan)
            if number not in known:
                yield f"{key}.{name} = {number}: there is no such drone; must be one of {list(known)}"
        if isinstance(fault, NameSwap) and fault.drones[0] == fault.drones[1]:
            yield f"{key}.drones = {list(fault.drones)}: must be two drones"
        if isinstance(fault, Cut | LinkChange) and fault.source in processes and fault.target in processes:
            subscribers = [name for name in processes if name != fault.source and plan.publishes_to(fault.source, name)]
            if fault.target not in subscribers:
                yield (
                    f"{key}.to = {fault.target!r}: receives nothing from {fault.source}; must be one of "
                    f"{', '.join(subscribers)}"
                )


def _possible(fault: Fault, plan: Plan) -> tuple[int, ...]:
    """Return the drones that `fault` may name."""
    swarm = plan.swarm
    if isinstance(fault, AgentFault):
        return swarm.followers
    if isinstance(fault, FalseHeight):  # the others have drivers of their own
        return tuple(i for i in swarm.flying if i not in swarm.driven)
    return swarm.flying if isinstance(fault, AirframeFault) else swarm.tracked


def _drones(fault: Fault) -> Iterator[tuple[str, int]]:
    if isinstance(fault, OfDrone):
        yield "drone", fault.drone
    elif isinstance(fault, NameSwap):
        for place, drone in enumerate(fault.drones):
            yield f"drones.{place}", drone


def _named(fault: Fault) -> Iterator[tuple[str, str]]:
    match fault:
        case Kill() | Restart() | Freeze() | ClockStep():
            yield "process", fault.process
        case Cut() | LinkChange():
            yield "from", fault.source
            yield "to", fault.target
        case Partition():
            for place, process in enumerate(fault.processes):
                yield f"processes.{place}", process
