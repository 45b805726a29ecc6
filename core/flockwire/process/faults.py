"""Faults as data: the faults of a flight and their times. One TOML file is used in real and virtual time.

    [[faults]]
    at = 12.0          # s after the order to take off
    kind = "kill"
    process = "uav3"

Times must be in order, unknown keys are refused. `flockwire sim` supports every kind, `flockwire up` all but SIM_ONLY,
and no loss or reordering of a link.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, ValidationError

from flockwire.swarm.model import uav
from flockwire.swarm.reading import error_lines, read_toml
from flockwire.swarm.tables import Finite, Model, NotNegative, Point, Positive, Probability
from flockwire.swarm.wording import meant
from flockwire.wire.plan import Plan

SIM_ONLY = ("clock",)


class FaultFileError(ValueError):
    """A bad fault file; each line of the text names one key, its value and the rule."""


class _Fault(Model):
    """The common part of all faults: `at`, s after the take-off order."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, populate_by_name=True)

    at: NotNegative


class Kill(_Fault):
    """The process ends at once (SIGKILL)."""

    kind: Literal["kill"]
    process: str


class Restart(_Fault):
    """The process restarts without state; if it still runs it is killed first."""

    kind: Literal["restart"]
    process: str


class Freeze(_Fault):
    """The process is frozen for a time (SIGSTOP, SIGCONT)."""

    kind: Literal["freeze"]
    process: str
    duration: Positive


class _LinkFault(_Fault):
    """Messages from `source` to `target` are disturbed for a time."""

    source: str = Field(alias="from")
    target: str = Field(alias="to")
    duration: Positive


class Cut(_LinkFault):
    """Nothing arrives; the other direction is unchanged (a real one for 1 s, until Zenoh closes the link)."""

    kind: Literal["cut"]


class LinkChange(_LinkFault):
    """The link has other conditions, as in the swarm file's [sim]."""

    kind: Literal["link"]
    delay: NotNegative = 0.0
    jitter: NotNegative = 0.0
    loss: Probability = 0.0
    reordering: Probability = 0.0


class Partition(_Fault):
    """Nothing passes between `processes` and all others."""

    kind: Literal["partition"]
    processes: Annotated[tuple[str, ...], Field(min_length=1)]
    duration: Positive


class TrackerLoss(_Fault):
    """The cameras do not see a drone."""

    kind: Literal["tracker"]
    drone: int
    duration: Positive


class NoiseBurst(_Fault):
    """The cameras have additional noise (m, standard deviation per axis)."""

    kind: Literal["noise"]
    noise: Positive
    duration: Positive


class NameSwap(_Fault):
    """The tracker exchanges the names of two drones' bodies."""

    kind: Literal["swap"]
    drones: tuple[int, int]
    duration: Positive


class Visitor(_Fault):
    """Another tracked body moves straight through the field: a person, a tracked obstacle."""

    kind: Literal["visitor"]
    body: str = "visitor"  # its name at the tracker
    start: Point  # m
    velocity: Point  # m/s
    duration: Positive


class ClockStep(_Fault):
    """The clock of a process is set by `step` s."""

    kind: Literal["clock"]
    process: str
    step: Finite


class AirframeLag(_Fault):
    """A simulated airframe gets another lag and dead time, s."""

    kind: Literal["lag"]
    drone: int
    lag: NotNegative
    dead_time: NotNegative = 0.0


class AirframeFailure(_Fault):
    """The motors of a simulated airframe stop: it falls."""

    kind: Literal["failure"]
    drone: int


Fault = (
    Kill | Restart | Freeze | Cut | LinkChange | Partition | TrackerLoss | NoiseBurst | NameSwap | Visitor | ClockStep
    | AirframeLag | AirframeFailure
)  # fmt: skip


class _File(Model):
    faults: tuple[Annotated[Fault, Field(discriminator="kind")], ...] = ()


def told(fault: Fault) -> str:
    """Return a fault in a few words: its kind and its target."""
    match fault:
        case Cut() | LinkChange():
            whom = f"{fault.source} → {fault.target}"
        case Partition():
            whom = ", ".join(fault.processes)
        case Visitor():
            whom = fault.body
        case NameSwap():
            whom = ", ".join(map(uav, fault.drones))
        case TrackerLoss() | AirframeLag() | AirframeFailure():
            whom = uav(fault.drone)
        case Kill() | Restart() | Freeze() | ClockStep():
            whom = fault.process
        case NoiseBurst():
            whom = ""
    return f"{fault.kind} {whom}".strip()


def load_faults(path: Path, plan: Plan) -> tuple[Fault, ...]:
    """Read and check the faults for the swarm of `plan` in the file `path`; raises FaultFileError."""
    return parse_faults(read_toml(path, "faults", FaultFileError), plan, str(path))


def parse_faults(table: dict[str, object], plan: Plan, origin: str) -> tuple[Fault, ...]:
    """Check the content `table` of the fault file `origin`; raises FaultFileError."""
    try:
        faults = _File.model_validate_json(json.dumps(table, default=str)).faults
    except ValidationError as error:
        raise FaultFileError("\n".join(f"{origin}: {line}" for line in error_lines(error, _File))) from None
    problems = list(_problems(faults, plan))
    if problems:
        raise FaultFileError("\n".join(f"{origin}: {line}" for line in problems))
    return faults


def of_core(faults: tuple[Fault, ...], plan: Plan, identity: str) -> tuple[Fault, ...]:
    """Return those of `faults` that the core of `identity` injects itself."""
    return tuple(fault for fault in faults if fault.kind in plan.rows[identity].faults)


def _problems(faults: tuple[Fault, ...], plan: Plan) -> Iterator[str]:
    processes = [identity for identity in plan.identities if identity not in plan.witnesses]
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
            known = plan.swarm.flying if isinstance(fault, AirframeLag | AirframeFailure) else plan.swarm.tracked
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


def _drones(fault: Fault) -> Iterator[tuple[str, int]]:
    match fault:
        case TrackerLoss() | AirframeLag() | AirframeFailure():
            yield "drone", fault.drone
        case NameSwap():
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
