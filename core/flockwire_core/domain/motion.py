"""The motion of a drone, known to its pilot, and the estimated motion of the leader."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import ZERO, Vector


@mypyc_attr(acyclic=True)
class Motion(Record):
    """A drone's measured position, m, its velocity, m/s, and its stopping point if commanded to stop now, m."""

    __slots__ = ("position", "velocity", "stopping")

    def __init__(self, position: Vector, velocity: Vector, stopping: Vector) -> None:
        self.position: Final = position
        self.velocity: Final = velocity
        self.stopping: Final = stopping


@mypyc_attr(acyclic=True)
class LeaderMotion(Record):
    """An estimate of the leader: position, m, velocity, m/s, acceleration, m/s^2, world frame."""

    __slots__ = ("position", "velocity", "acceleration")

    def __init__(self, position: Vector, velocity: Vector = ZERO, acceleration: Vector = ZERO) -> None:
        self.position: Final = position
        self.velocity: Final = velocity
        self.acceleration: Final = acceleration

    def after(self, dt: float) -> LeaderMotion:
        """Return the motion `dt` s later: x + dt v + dt^2 a / 2, v + dt a, a."""
        x, v, a = self.position, self.velocity, self.acceleration
        half = 0.5 * dt * dt
        return LeaderMotion(
            (x[0] + dt * v[0] + half * a[0], x[1] + dt * v[1] + half * a[1], x[2] + dt * v[2] + half * a[2]),
            (v[0] + dt * a[0], v[1] + dt * a[1], v[2] + dt * a[2]),
            a,
        )


class Leading(IntEnum):
    """Whether the leader leads, in the air, or not."""

    UNKNOWN = 0
    LEADS = 1
    IS_DOWN = 2  # it lands, is on the ground, has fallen, or its process is silent


@mypyc_attr(acyclic=True)
class Estimate(Record):
    """One follower's estimate of the leader's motion at `stamp` (Unix ns).

    `origin` is the time of the leader's pose that it is based on, Unix ns, after as many `hops`.
    """

    __slots__ = ("stamp", "frame", "motion", "origin", "hops", "leading")

    def __init__(
        self,
        stamp: int,
        frame: str,
        motion: LeaderMotion,
        origin: int = 0,
        hops: int = 0,
        leading: Leading = Leading.UNKNOWN,
    ) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.motion: Final = motion
        self.origin: Final = origin
        self.hops: Final = hops
        self.leading: Final = leading
