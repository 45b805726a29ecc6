"""The velocity of a teleoperated leader: what a person asks for, bounded; without fresh commands it keeps its place."""

from __future__ import annotations

from flockwire.domain.time import SECOND
from flockwire.domain.vector import ZERO, Vector, add, limit, norm, subtract
from flockwire.pilot.phases import age, keep_place
from flockwire.swarm.model import Swarm
from flockwire.wire.messages import Command

STILL = 1e-6  # m/s below which the leader keeps its place


class Teleoperation:
    """Follows the newest steering command of `swarm`'s leader.

    Speed and acceleration are those of [leader]. A command older than `limits.staleness.steering_stop` is none: the
    leader stops at once.
    """

    def __init__(self, swarm: Swarm) -> None:
        self._leader, self._rise = swarm.leader, swarm.limits.vertical_speed
        self._stale = swarm.limits.staleness.steering_stop
        self._newest: Command | None = None
        self._velocity: Vector = ZERO
        self._place: Vector | None = None  # which it keeps while it is not steered

    def take(self, command: Command) -> None:
        """Take the newest command: a velocity in m/s, world frame."""
        self._newest = command

    def rest(self) -> None:
        """Start again from rest: the leader does something else."""
        self._velocity, self._place = ZERO, None

    def velocity(self, position: Vector, now: int, dt: float) -> Vector:
        """Return the velocity to want, m/s, at `position` (m) and `now` (Unix ns), `dt` s after the last one."""
        newest = self._newest
        if newest is None or age(newest.stamp, now) > self._stale:
            self._velocity = ZERO
        else:
            wanted = limit(newest.velocity, self._leader.speed)
            change = limit(subtract(wanted, self._velocity), self._leader.acceleration * dt)
            self._velocity = add(self._velocity, change)
        if norm(self._velocity) > STILL:
            self._place = None
            return self._velocity
        self._place = self._place or position
        return keep_place(position, self._place, self._rise)

    def described(self, now: int) -> str:
        """Return what is to be known of the link, empty when commands come."""
        if self._newest is None:
            return "no steering command"
        silence = (now - self._newest.stamp) / SECOND
        return f"no steering command for {silence:.1f} s" if silence > self._stale else ""
