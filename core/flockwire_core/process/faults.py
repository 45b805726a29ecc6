"""Faults as data: one model for each kind. fault_file.py reads them from a file.

`flockwire sim` supports every kind, `flockwire up` all but SIM_ONLY, and no loss or reordering of a link.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Finite, Items, Model, NotNegative, Point, Positive, Probability

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
    """The process restarts without state, in virtual time after 0.5 s; if it still runs, it is killed first."""

    kind: Literal["restart"]
    process: str


class Freeze(_Fault):
    """The process is frozen (SIGSTOP, SIGCONT); the newest messages of this time are buffered."""

    kind: Literal["freeze"]
    process: str
    duration: Positive


class _LinkFault(_Fault):
    """Messages from `source` to `target` are disturbed for a time."""

    source: str = Field(alias="from")
    target: str = Field(alias="to")
    duration: Positive


class Cut(_LinkFault):
    """Nothing that `from` publishes reaches `to`; the other direction is open.

    Zenoh closes a real link after 1 s, in both directions.
    """

    kind: Literal["cut"]


class LinkChange(_LinkFault):
    """`delay` and `jitter` (s), `loss` and `reordering` (shares) replace those of [sim].

    A real flight adds the first two to the link's own; the others must be 0.
    """

    kind: Literal["link"]
    delay: NotNegative = 0.0
    jitter: NotNegative = 0.0
    loss: Probability = 0.0
    reordering: Probability = 0.0


class Partition(_Fault):
    """Nothing passes between these processes and all others, except the operator."""

    kind: Literal["partition"]
    processes: Annotated[Items[str], Field(min_length=1)]
    duration: Positive


class TrackerLoss(_Fault):
    """The tracker does not see the drone."""

    kind: Literal["tracker"]
    drone: int
    duration: Positive


class NoiseBurst(_Fault):
    """The tracker's noise grows by `noise` (m, standard deviation per axis; root of the sum of squares)."""

    kind: Literal["noise"]
    noise: Positive
    duration: Positive


class NameSwap(_Fault):
    """The tracker exchanges the names of two drones' bodies."""

    kind: Literal["swap"]
    drones: Annotated[tuple[int, int], Field(strict=False)]
    duration: Positive


class Visitor(_Fault):
    """Another body with this name at the tracker moves straight on from `start` (m) at `velocity` (m/s).

    By its name it is a person or a tracked obstacle.
    """

    kind: Literal["visitor"]
    body: str = "visitor"  # its name at the tracker
    start: Point  # m
    velocity: Point  # m/s
    duration: Positive


class ClockStep(_Fault):
    """The clock of the process is set forward by `step` (s; may be negative)."""

    kind: Literal["clock"]
    process: str
    step: Finite


class AirframeLag(_Fault):
    """The simulated airframe has this `lag` and `dead_time` (s) from now on; its agent does not know."""

    kind: Literal["lag"]
    drone: int
    lag: NotNegative
    dead_time: NotNegative = 0.0


class WindChange(_Fault):
    """A `velocity` and a `gust` (m/s) replace the [wind] of all simulated airframes."""

    kind: Literal["wind"]
    velocity: Point = (0.0, 0.0, 0.0)
    gust: NotNegative = 0.0
    duration: Positive


class AirframeFailure(_Fault):
    """The motors of the simulated airframe stop: it falls."""

    kind: Literal["failure"]
    drone: int


class FalseEstimate(_Fault):
    """The follower publishes a leader estimate that moves away from its own one at `velocity` (m/s)."""

    kind: Literal["false_estimate"]
    drone: int
    velocity: Point
    duration: Positive


class FalseAge(_Fault):
    """The follower claims that the leader leads and that its data of the leader is `age` (s) old."""

    kind: Literal["false_age"]
    drone: int
    age: NotNegative
    duration: Positive


class FalseBids(_Fault):
    """The follower claims every place of an auction at `price` (m²)."""

    kind: Literal["false_bids"]
    drone: int
    price: Positive
    duration: Positive


class FalsePose(_Fault):
    """The tracker reports the drone at a place that moves away from it at `velocity` (m/s)."""

    kind: Literal["false_pose"]
    drone: int
    velocity: Point
    duration: Positive


class FalseHeight(_Fault):
    """The telemetry of an airframe without a driver of its own reports a height that is `offset` (m) too large."""

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
