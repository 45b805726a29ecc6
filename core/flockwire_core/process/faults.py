"""Faults as data: one model for each kind. fault_file.py reads them from a file.

`flockwire sim` supports every kind, `flockwire up` all but SIM_ONLY, and no loss or reordering of a link.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Finite, Model, NotNegative, Point, Positive, Probability

SIM_ONLY = ("clock",)


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


class WindChange(_Fault):
    """Simulated airframes have another wind for a time, as in the swarm file's [wind]."""

    kind: Literal["wind"]
    velocity: Point = (0.0, 0.0, 0.0)
    gust: NotNegative = 0.0
    duration: Positive


class AirframeFailure(_Fault):
    """The motors of a simulated airframe stop: it falls."""

    kind: Literal["failure"]
    drone: int


class FalseEstimate(_Fault):
    """A follower's agent publishes a leader estimate that moves away from its own one at `velocity`, m/s."""

    kind: Literal["false_estimate"]
    drone: int
    velocity: Point
    duration: Positive


class FalseAge(_Fault):
    """A follower's agent claims that the leader leads, and that its data of the leader is `age` s old."""

    kind: Literal["false_age"]
    drone: int
    age: NotNegative
    duration: Positive


class FalseBids(_Fault):
    """A follower's agent claims every place of an auction, at `price`, m^2."""

    kind: Literal["false_bids"]
    drone: int
    price: Positive
    duration: Positive


class FalsePose(_Fault):
    """The cameras report a drone at a place that moves away from it at `velocity`, m/s."""

    kind: Literal["false_pose"]
    drone: int
    velocity: Point
    duration: Positive


class FalseHeight(_Fault):
    """The driver of a simulated airframe reports a height that is `offset` m too large."""

    kind: Literal["false_height"]
    drone: int
    offset: Finite
    duration: Positive


Fault = (
    Kill | Restart | Freeze | Cut | LinkChange | Partition | TrackerLoss | NoiseBurst | NameSwap | Visitor | ClockStep
    | AirframeLag | WindChange | AirframeFailure | FalseEstimate | FalseAge | FalseBids | FalsePose
    | FalseHeight
)  # fmt: skip
AgentFault = FalseEstimate | FalseAge | FalseBids
AirframeFault = AirframeLag | AirframeFailure | FalseHeight
OfDrone = TrackerLoss | FalsePose | AgentFault | AirframeFault  # those with a key `drone`


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
        case Kill() | Restart() | Freeze() | ClockStep():
            whom = fault.process
        case NoiseBurst() | WindChange():
            whom = ""
        case _:
            whom = uav(fault.drone)
    return f"{fault.kind} {whom}".strip()
