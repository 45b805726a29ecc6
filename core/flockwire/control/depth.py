"""Depth: how the error of the leader's estimate grows with the hops from the leader, under the extended law."""

from __future__ import annotations

from math import dist, sqrt

from flockwire.control.leader_track import LeaderTrack
from flockwire.control.trajectory import Trajectory
from flockwire.control.vector import ZERO


def noise_gain(time_constant: float, age: float, period: float) -> float:
    """Return the standard deviation of the estimate per axis, for noise of 1 on the leader's poses.

        sqrt( sum_k h_k^2 ),   h the response of the position extrapolated by `age` s to one pose that is 1 m off

    `period` is the time between two poses, s.
    """
    leader, steps = LeaderTrack(time_constant), round(12.0 * time_constant / period) + 1
    for k in range(steps):  # until its gains are the steady ones
        leader.update(ZERO, k * period)
    pulse = [(1.0 if k == 0 else 0.0, 0.0, 0.0) for k in range(steps)]
    response = (leader.update(z, (steps + k) * period).after(age).position[0] for k, z in enumerate(pulse))
    return sqrt(sum(x * x for x in response))


def motion_error(trajectory: Trajectory, time_constant: float, age: float, period: float, horizon: float) -> float:
    """Return the largest error, m, of the leader's position extrapolated by `age` s, without noise.

    The leader flies `trajectory` for `horizon` s; its first 12 time constants, the tracker's own, are left out. Corners
    and jumps of its velocity are in it: speed · age at least, whatever the law.
    """
    leader, worst = LeaderTrack(time_constant), 0.0
    for k in range(round(horizon / period) + 1):
        now = k * period
        estimate = leader.update(trajectory.position(now), now).after(age).position
        if now > 12.0 * time_constant:
            worst = max(worst, dist(trajectory.position(now + age), estimate))
    return worst
