"""The leader's motion, tracked by its out-neighbours: noise enters the swarm here, and is filtered only here.

The remaining noise grows with the hops from the leader, over which the track is extrapolated.
"""

from __future__ import annotations

from math import dist, sqrt

from flockwire_core.control.tracker import AccelerationTracker, VelocityTracker
from flockwire_core.control.trajectory import Trajectory
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.vector import ZERO, Vector


class LeaderTrack:
    """The leader's motion from its poses: a fast tracker for position, a slow one for velocity and acceleration.

    `time_constant` is the slow one's, s. The fast tracker follows a jump of the leader's velocity at once; many hops
    extrapolate the slow one's velocity and acceleration, which have little noise.
    """

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self._fast: VelocityTracker | None = None
        self._slow: AccelerationTracker | None = None

    def update(self, position: Vector, stamp: float) -> LeaderMotion:
        """Receive the `position` (m) measured at `stamp` (s); return the motion at `stamp`."""
        # s without a pose after which the track restarts
        if self._fast is None or self._slow is None or stamp - self._fast.stamp > 1.0:
            self._fast = VelocityTracker(0.05, position, stamp)  # s, of the tracker of the leader's position
            self._slow = AccelerationTracker(self._time_constant, position, stamp)
        self._fast.update(position, stamp)
        self._slow.update(position, stamp)
        return LeaderMotion(self._fast.position, self._slow.velocity, self._slow.acceleration)


def noise_gain(time_constant: float, age: float, period: float) -> float:
    """Return the standard deviation of the estimate per axis, for noise of 1 on the leader's poses.

        sqrt( sum_k h_k^2 ),   h the response of the position extrapolated by `age` s to one pose that is 1 m off

    `period` is the time between two poses, s.
    """
    leader, steps = LeaderTrack(time_constant), round(12.0 * time_constant / period) + 1
    for k in range(steps):  # until its gains are constant
        leader.update(ZERO, k * period)
    pulse = [(1.0 if k == 0 else 0.0, 0.0, 0.0) for k in range(steps)]
    response = (leader.update(z, (steps + k) * period).after(age).position[0] for k, z in enumerate(pulse))
    return sqrt(sum(x * x for x in response))


def motion_error(trajectory: Trajectory, time_constant: float, age: float, period: float, horizon: float) -> float:
    """Return the largest error, m, of the leader's position extrapolated by `age` s, without noise.

    The leader flies `trajectory` for `horizon` s; the first 12 time constants are left out. Corners and jumps of the
    velocity are included: they cost at least speed · age with any law.
    """
    leader, worst = LeaderTrack(time_constant), 0.0
    for k in range(round(horizon / period) + 1):
        now = k * period
        estimate = leader.update(trajectory.position(now), now).after(age).position
        if now > 12.0 * time_constant:
            worst = max(worst, dist(trajectory.position(now + age), estimate))
    return worst
