"""The interface of a control law; your own law needs no other module of flockwire (docs/own_law.md).

A law is pure: an observation and the time go in, a velocity and an estimate come out. It reads no clock, does no input
or output and draws no random numbers; it may keep state from step to step. `[control] law = "package.module:ClassName"`
flies any class of this form. Positions are m, velocities m/s, world frame (ENU); times are Unix ns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Final, NamedTuple, Protocol

from flockwire_core.compiling import mypyc_attr
from flockwire_core.control.around.bent_place import DetourParameters
from flockwire_core.control.around.sidestep import SidestepParameters
from flockwire_core.control.formation import Formation
from flockwire_core.control.observer import ObserverParameters
from flockwire_core.control.potential import PotentialParameters
from flockwire_core.control.protocol import ProtocolParameters
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.record import Record
from flockwire_core.domain.signals import LONGEST_NAME, MOST_SIGNALS
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, distance, limit, norm, scale, subtract
from flockwire_core.swarm.tables import Finite, NotNegative, Parameters, Positive

__all__ = [
    "SECOND", "ZERO", "Body", "BodyKind", "Decision", "Finite", "Law", "LawSettings", "LeaderMotion", "Motion",
    "NeighbourEstimate", "NotNegative", "Observation", "Parameters", "Positive", "Reference", "Vector",
    "add", "distance", "limit", "norm", "scale", "subtract",
]  # fmt: skip

END_OF_TIME: Final = SECOND << 31  # Unix ns of the first stamp that a message cannot hold


class LawSettings(NamedTuple):
    """The input of a law's constructor: one drone's constants, and the gains of the swarm file."""

    number: int  # of the follower
    period: float  # s, between two steps
    lag: float  # s, of its airframe
    dead_time: float  # s, likewise
    speed: float  # m/s, at most
    acceleration: float  # m/s^2, at most
    parameters: Mapping[str, object]  # [control.parameters], for `Parameters.of`
    protocol: ProtocolParameters  # the gains of (9)
    observer: ObserverParameters  # the gains of (8)
    explicit_observer: bool  # whether (8) is stepped forward, not backward (law "paper")
    velocity_time_constant: float  # s, of the filter of the estimated velocity (law "paper")
    leader_time_constant: float  # s, of the tracker of the leader's velocity (law "extended")
    potentials: PotentialParameters  # of (9)
    sidestep: SidestepParameters  # round drones that are in the way (law "extended")
    detour: DetourParameters  # round bodies, and within the room (law "extended")


@mypyc_attr(acyclic=True)
class NeighbourEstimate(Record):
    """One in-neighbour's estimate of the leader; the leader itself, `number` 0, has only a position."""

    __slots__ = ("number", "weight", "stamp", "motion")

    def __init__(self, number: int, weight: float, stamp: int, motion: LeaderMotion) -> None:
        self.number: Final = number
        self.weight: Final = weight  # w_ij
        self.stamp: Final = stamp  # the time for which it is valid
        self.motion: Final = motion


@mypyc_attr(acyclic=True)
class Reference(Record):
    """The place in the formation: `offset` h_i and `rate` h_i' at any time."""

    __slots__ = ("formation", "rank", "start")

    def __init__(self, formation: Formation, rank: int, start: int) -> None:
        self.formation: Final = formation
        self.rank: Final = rank
        self.start: Final = start  # time 0 of the formation

    def offset(self, when: int) -> Vector:
        """Return h_i, m."""
        return self.formation.offset(self.rank, (when - self.start) / SECOND)

    def rate(self, when: int) -> Vector:
        """Return h_i', m/s."""
        return self.formation.offset_rate(self.rank, (when - self.start) / SECOND)


@mypyc_attr(acyclic=True)
class Observation(Record):
    """The input of a law at one step."""

    __slots__ = ("dt", "stamp", "motion", "neighbour_estimates", "bodies", "reference")

    def __init__(
        self,
        dt: float,
        stamp: int,
        motion: Motion | None,
        neighbour_estimates: Sequence[NeighbourEstimate],
        bodies: Sequence[Body],
        reference: Reference | None,
    ) -> None:
        self.dt: Final = dt  # s since the last step
        self.stamp: Final = stamp  # of the own pose
        self.motion: Final = motion  # position, velocity and stopping point; None while the drone's pose is stale
        self.neighbour_estimates: Final = neighbour_estimates  # only fresh ones
        self.bodies: Final = bodies  # nearby bodies, relative to the drone
        self.reference: Final = (
            reference  # None outside the formation phase, or without a place: the velocity is not used
        )


@mypyc_attr(acyclic=True)
class Decision(Record):
    """The output of a law: a velocity for the airframe and, for its subscribers, an estimate of the leader.

    `signals` are numbers by name that the trace keeps; no other drone receives them.
    """

    __slots__ = ("velocity", "estimate", "stamp", "signals")

    def __init__(
        self,
        velocity: Vector = ZERO,
        estimate: LeaderMotion | None = None,
        stamp: int = 0,
        signals: Mapping[str, float] | None = None,
    ) -> None:
        self.velocity: Final = velocity
        self.estimate: Final = estimate  # None: nothing to publish
        self.stamp: Final = stamp  # the time for which the estimate is valid; 0 means now
        self.signals: Final = signals  # of your own law: None, nothing to record


class Law(Protocol):
    """A control law of one follower."""

    def __init__(self, settings: LawSettings) -> None:
        """Start."""

    def step(self, observation: Observation, now: int) -> Decision:
        """Return the decision at `now`; called at the control rate, also on the ground."""


def check_decision(decision: object) -> None:
    """Raise an error for a decision that cannot be flown, or that compiled code would not take."""
    if not isinstance(decision, Decision):
        raise TypeError(f"a step must return a Decision, not {decision!r}")
    estimate, total = decision.estimate, _total(decision.velocity, decision)
    if estimate is not None:
        for vector in (estimate.position, estimate.velocity, estimate.acceleration):
            total += _total(vector, decision)
    if not isinstance(total, float) or not isinstance(decision.stamp, int) or not 0 <= decision.stamp < END_OF_TIME:
        raise _malformed(decision)
    if not -inf < total < inf:
        raise ValueError(f"{decision}: holds a number that is not finite")
    if decision.signals is not None:
        _check_signals(decision.signals)


def _check_signals(signals: Mapping[Any, Any]) -> None:
    """Raise ValueError for signals that a trace cannot keep."""
    if len(signals) > MOST_SIGNALS:
        raise ValueError(f"{len(signals)} signals: must be {MOST_SIGNALS} or fewer")
    for name, value in signals.items():
        if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME:
            raise ValueError(f"signal {name!r}: its name must be text of 1 to {LONGEST_NAME} characters")
        if not isinstance(value, float | int) or not -inf < float(value) < inf:
            raise ValueError(f"signal {name!r} = {value!r}: must be a finite number")


def _total(vector: Vector, decision: Decision) -> float:
    """Return the sum of a vector's three numbers; raises what their sum with a float raises, if they are none."""
    if not isinstance(vector, tuple) or len(vector) != 3:
        raise _malformed(decision)
    return 0.0 + vector[0] + vector[1] + vector[2]


def _malformed(decision: Decision) -> ValueError:
    return ValueError(f"a vector must be a tuple of three floats, the stamp an int, in ns: {decision}")
