"""Faults as data: what is to go wrong in a flight, and when. One TOML file drives real and virtual time.

    [[faults]]
    at = 12.0          # s after the order to take off
    kind = "kill"
    process = "uav3"

Times must be in order, unknown keys are refused. `flockwire sim` honours every kind, `flockwire up` those that a
machine can really do to its processes and their links (all but SIM_ONLY, and of a link no loss and no reordering).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import ConfigDict, Field, ValidationError

from flockwire import policy
from flockwire.config import error_lines
from flockwire.tables import Finite, Model, NotNegative, Positive, Probability
from flockwire.toml_file import read_toml
from flockwire.wiring import identities

if TYPE_CHECKING:
    from flockwire.config import Swarm

WITNESSES = ("recorder", "operator")  # no fault takes these: without them there is no flight to judge
SIM_ONLY = ("clock",)


class FaultFileError(ValueError):
    """A file of faults that cannot be used; each line of the text names one key, its value and the rule."""


class _Fault(Model):
    """What all faults have: `at`, s after the order to take off."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, populate_by_name=True)

    at: NotNegative


class Kill(_Fault):
    """The process ends at once (SIGKILL)."""

    kind: Literal["kill"]
    process: str


class Restart(_Fault):
    """The process begins anew, with nothing known; if it still runs it is killed first."""

    kind: Literal["restart"]
    process: str


class Freeze(_Fault):
    """The process stands still for a time (SIGSTOP, SIGCONT)."""

    kind: Literal["freeze"]
    process: str
    duration: Positive


class _LinkFault(_Fault):
    """What `source` says to `target` does not travel as usual for a time."""

    source: str = Field(alias="from")
    target: str = Field(alias="to")
    duration: Positive


class Cut(_LinkFault):
    """Nothing arrives; the other direction stays as it is (a real one for 1 s, when Zenoh gives the link up)."""

    kind: Literal["cut"]


class LinkChange(_LinkFault):
    """Other conditions hold, as in the swarm file's [sim]."""

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
    """The cameras measure with this much more noise (m, standard deviation per axis)."""

    kind: Literal["noise"]
    noise: Positive
    duration: Positive


class ClockStep(_Fault):
    """Somebody sets the clock of a process by `step` s."""

    kind: Literal["clock"]
    process: str
    step: Finite


class AirframeLag(_Fault):
    """A simulated airframe answers with another lag and dead time, s."""

    kind: Literal["lag"]
    drone: int
    lag: NotNegative
    dead_time: NotNegative = 0.0


class AirframeFailure(_Fault):
    """The motors of a simulated airframe stop: it falls."""

    kind: Literal["failure"]
    drone: int


Fault = (
    Kill | Restart | Freeze | Cut | LinkChange | Partition | TrackerLoss | NoiseBurst | ClockStep
    | AirframeLag | AirframeFailure
)  # fmt: skip


class _File(Model):
    faults: tuple[Annotated[Fault, Field(discriminator="kind")], ...] = ()


def load_faults(path: Path, swarm: Swarm) -> tuple[Fault, ...]:
    """Read and check the faults for `swarm` in the file `path`; raises FaultFileError."""
    return parse_faults(read_toml(path, "faults", FaultFileError), swarm, str(path))


def parse_faults(table: dict[str, object], swarm: Swarm, origin: str) -> tuple[Fault, ...]:
    """Check the content `table` of a file of faults, which came from `origin`; raises FaultFileError."""
    try:
        faults = _File.model_validate_json(json.dumps(table, default=str)).faults
    except ValidationError as error:
        raise FaultFileError("\n".join(f"{origin}: {line}" for line in error_lines(error))) from None
    problems = list(_problems(faults, swarm))
    if problems:
        raise FaultFileError("\n".join(f"{origin}: {line}" for line in problems))
    return faults


def _problems(faults: tuple[Fault, ...], swarm: Swarm) -> Iterator[str]:
    processes = [identity for identity in identities(swarm) if identity not in WITNESSES]
    before = 0.0
    for place, fault in enumerate(faults):
        key = f"faults.{place}"
        if fault.at < before:
            yield f"{key}.at = {fault.at:g}: must not be before that of the fault above, {before:g}"
        before = max(before, fault.at)
        for name, process in _named(fault):
            if process not in processes:
                yield f"{key}.{name} = {process!r}: there is no such process; must be one of {', '.join(processes)}"
        number = getattr(fault, "drone", None)
        if number is not None and number not in swarm.flying:
            yield f"{key}.drone = {number}: there is no such drone; must be one of {list(swarm.flying)}"
        if isinstance(fault, Cut | LinkChange) and fault.source in processes and fault.target in processes:
            hearers = _hearers(swarm, fault.source)
            if fault.target not in hearers:
                yield (
                    f"{key}.to = {fault.target!r}: hears nothing of {fault.source}; must be one of {', '.join(hearers)}"
                )


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


def _hearers(swarm: Swarm, speaker: str) -> list[str]:
    found = {hearer for _, speakers, hearers in policy.flows(swarm) if speaker in speakers for hearer in hearers}
    return [name for name in identities(swarm) if name in found and name != speaker and name not in WITNESSES]
