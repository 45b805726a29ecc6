"""The interface of a control law.

A law is pure: an observation and the time go in, a velocity and an estimate come out. It reads no clock, does no input
or output and draws no random numbers; it may keep state from step to step. `[control] law = "package.module:ClassName"`
flies any class of this form. Positions are m, velocities m/s, world frame (ENU); times are Unix ns.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple, Protocol

from flockwire.control.airframe_state import Motion
from flockwire.control.formation import Formation
from flockwire.control.relay import LeaderMotion
from flockwire.control.vector import ZERO, Vector
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Body

if TYPE_CHECKING:
    from flockwire.swarm.model import Swarm


FAILED = "the law failed"  # what the status of a drone begins with whose law raised


class NeighbourEstimate(NamedTuple):
    """What one in-neighbour published of the leader; of the leader itself, `number` 0, only the position is known."""

    number: int
    weight: float  # w_ij
    stamp: int  # the time for which it holds
    motion: LeaderMotion


class Reference(NamedTuple):
    """The place in the formation: `offset` h_i and `rate` h_i' at any time."""

    formation: Formation
    rank: int
    start: int  # when the formation's time is 0

    def offset(self, when: int) -> Vector:
        """Return h_i, m."""
        return self.formation.offset(self.rank, (when - self.start) / BILLION)

    def rate(self, when: int) -> Vector:
        """Return h_i', m/s."""
        return self.formation.offset_rate(self.rank, (when - self.start) / BILLION)


class Observation(NamedTuple):
    """All that a law may know at one step."""

    dt: float  # s since the last step
    stamp: int  # of the own pose
    motion: Motion | None  # the own position, velocity and stopping point; None while the own pose is stale
    neighbour_estimates: Sequence[NeighbourEstimate]  # the fresh ones
    bodies: Sequence[Body]  # what is near, relative to the own position
    reference: Reference | None  # None outside the formation phase: then the velocity is not used


class Decision(NamedTuple):
    """What a law wants: a velocity for the airframe and, for its subscribers, an estimate of the leader."""

    velocity: Vector = ZERO
    estimate: LeaderMotion | None = None  # None: nothing to publish yet
    stamp: int = 0  # the time for which the estimate holds; 0 stands for now


class Law(Protocol):
    """A control law of follower `number` of `swarm`."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        """Begin."""

    def step(self, observation: Observation, now: int) -> Decision:
        """Return what to do at `now`; called at the control rate, on the ground too."""


def check_decision(decision: Decision) -> None:
    """Raise ValueError for a decision that cannot be flown."""
    vectors = (decision.velocity, *(decision.estimate or ()))
    if any(len(vector) != 3 for vector in vectors) or not isinstance(decision.stamp, int):
        raise ValueError(f"a vector must have three numbers, the stamp must be an int, in ns: {decision}")
    if not isfinite(sum([number for vector in vectors for number in vector])):
        raise ValueError(f"{decision}: holds a number that is not finite")
