"""The velocity of a teleoperated leader: the limited steering command; without fresh commands it stops."""

from __future__ import annotations

from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, subtract
from flockwire_core.pilot.phases import age
from flockwire_core.pilot.wanted import keep_place
from flockwire_core.swarm.model import Swarm


class Teleoperation:
    """Follows the leader's newest steering command within its speed and acceleration.

    A command older than limits.staleness.steering_stop is none: the leader stops at once.
    """

    def __init__(self, swarm: Swarm, number: int) -> None:
        leader = swarm.leading[number]
        self._speed, self._acceleration = leader.speed, leader.acceleration  # m/s, m/s^2
        self._vertical_speed, self._stale = swarm.limits.vertical_speed, swarm.limits.staleness.steering_stop  # m/s, s
        self._newest: Steer | None = None
        self._velocity: Vector = ZERO
        self._place: Vector | None = None  # held while it is not steered

    def take(self, command: Steer) -> None:
        """Receive the newest command: a velocity in m/s, world frame."""
        self._newest = command

    def rest(self) -> None:
        """Reset to rest: the leader is not steered."""
        self._velocity, self._place = ZERO, None

    def velocity(self, position: Vector, now: int, dt: float) -> Vector:
        """Return the desired velocity, m/s, at `position` (m) and `now` (Unix ns), `dt` s after the last one."""
        newest = self._newest
        if newest is None or age(newest.stamp, now) > self._stale:
            self._velocity = ZERO
        else:
            wanted = limit(newest.velocity, self._speed)
            change = limit(subtract(wanted, self._velocity), self._acceleration * dt)
            self._velocity = add(self._velocity, change)
        if norm(self._velocity) > 1e-6:  # m/s below which the leader holds its position
            self._place = None
            return self._velocity
        self._place = self._place or position
        return keep_place(position, self._place, self._vertical_speed)

    def described(self, now: int) -> str:
        """Return the problem of the link, empty while commands arrive."""
        if self._newest is None:
            return "no steering command"
        silence = (now - self._newest.stamp) / SECOND
        return f"no steering command for {silence:.1f} s" if silence > self._stale else ""
