"""The leader as its out-neighbours track it: noise enters the swarm here, and is filtered here, once."""

from __future__ import annotations

from flockwire.control.relay import LeaderMotion
from flockwire.control.tracker import AccelerationTracker, VelocityTracker
from flockwire.control.vector import Vector

POSITION_TIME_CONSTANT = 0.05
"""Seconds: of the tracker of the leader's position."""

FORGET = 1.0
"""Seconds without a pose after which the track restarts."""


def leader_time_constant(depth: int) -> float:
    """Return the time constant T, s, of the tracker of the leader's velocity for a swarm of `depth` hops.

        T = 0.15 s + 0.01 s · depth        (ours)

    The deepest drone extrapolates the longest, so noise weighs most there; a slower tracker is later to see a turn.
    """
    return 0.15 + 0.01 * depth


class LeaderTrack:
    """The leader's motion from its poses: a fast tracker for where it is, a slow one for where it goes.

    `time_constant` is the slow one's, s. A jump of the leader's velocity is seen by the fast tracker at once; what is
    extrapolated over many hops is the slow one's velocity and acceleration, which carry little noise.
    """

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self._fast: VelocityTracker | None = None
        self._slow: AccelerationTracker | None = None

    def update(self, position: Vector, stamp: float) -> LeaderMotion:
        """Take the `position` (m) measured at `stamp` (s); return the motion then."""
        if self._fast is None or self._slow is None or stamp - self._fast.stamp > FORGET:
            self._fast = VelocityTracker(POSITION_TIME_CONSTANT, position, stamp)
            self._slow = AccelerationTracker(self._time_constant, position, stamp)
        self._fast.update(position, stamp)
        self._slow.update(position, stamp)
        return LeaderMotion(self._fast.position, self._slow.velocity, self._slow.acceleration)
