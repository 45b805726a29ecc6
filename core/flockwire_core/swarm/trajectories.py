"""Trajectories and speeds of leaders by their tables, for who leads and for who looks ahead; agents need neither."""

from __future__ import annotations

from flockwire_core.control.key_frames import parse_key_frames
from flockwire_core.control.trajectory import Circling, Constant, Timed, Trajectory, Waypoints
from flockwire_core.domain.vector import ZERO
from flockwire_core.swarm import leader as tables
from flockwire_core.swarm.leader import Leader
from flockwire_core.swarm.model import Swarm


def trajectory_of(leader: Leader) -> Trajectory:
    """Return the trajectory of its table; raises ValueError for key frames that cannot be read."""
    match leader.trajectory:
        case tables.ConstantVelocity(velocity=velocity):
            return Constant(velocity)
        case tables.CirclingTrajectory(radius=radius, rate=rate):
            return Circling(radius, rate)
        case tables.WaypointsTrajectory(points=points, speed=speed, loop=loop):
            return Waypoints(points, speed, loop)
        case tables.KeyFramesTrajectory(frames=frames):
            return Timed(parse_key_frames(frames))


def course_of(leader: Leader) -> Trajectory:
    """Return its known course; a leader whose motion is unforeseen is assumed to stay."""
    return Constant(ZERO) if leader.unforeseen else trajectory_of(leader)


def speed_of(leader: Leader) -> float:
    """Return the highest expected speed of the leader, m/s."""
    return leader.speed if leader.unforeseen else trajectory_of(leader).fastest


def leader_speed(swarm: Swarm) -> float:
    """Return the highest expected speed of a leader, m/s."""
    return max(map(speed_of, swarm.leading.values()), default=0.0)
