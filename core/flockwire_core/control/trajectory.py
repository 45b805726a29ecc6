"""The leader's scripted trajectories: position relative to the start, and its rate, as functions of mission time.

For t <= 0 a trajectory stays at its start. The rate is the leader's input u_0 of (3), which no follower knows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, sin

from flockwire_core.control.key_frames import KeyFrames
from flockwire_core.domain.record import Frozen
from flockwire_core.domain.vector import ZERO, Vector, add, distance, norm, scale, subtract

LOOKS = 6  # parts of a span of key frames, between which its speed is looked at


@dataclass(frozen=True, slots=True)
class Constant(Frozen):
    """Straight on: x_0(t) = v t."""

    velocity: Vector

    @property
    def fastest(self) -> float:
        """The highest |u_0|, m/s."""
        return norm(self.velocity)

    def position(self, t: float) -> Vector:
        """Return the displacement from the start, m, world frame, at mission time t, s."""
        return scale(self.velocity, max(t, 0.0))

    def rate(self, t: float) -> Vector:
        """Return u_0, m/s, world frame."""
        return self.velocity if t > 0.0 else ZERO


@dataclass(frozen=True, slots=True)
class Circling(Frozen):
    """A circle of `radius` m through the start, at `angular_rate` rad/s: x_0(t) = r [sin(w t), 1 - cos(w t), 0]."""

    radius: float
    angular_rate: float

    @property
    def fastest(self) -> float:
        """The highest |u_0|, m/s."""
        return abs(self.radius * self.angular_rate)

    def position(self, t: float) -> Vector:
        """Return the displacement from the start, m, world frame, at mission time t, s."""
        angle = self.angular_rate * max(t, 0.0)
        return (self.radius * sin(angle), self.radius * (1.0 - cos(angle)), 0.0)

    def rate(self, t: float) -> Vector:
        """Return u_0, m/s, world frame."""
        if t <= 0.0:
            return ZERO
        angle, speed = self.angular_rate * t, self.radius * self.angular_rate
        return (speed * cos(angle), speed * sin(angle), 0.0)


@dataclass(frozen=True, slots=True)
class Waypoints(Frozen):
    """Straight legs at constant `speed` m/s through `points` (relative to the start), once or without end."""

    points: tuple[Vector, ...]
    speed: float
    loop: bool = False
    _legs: tuple[tuple[float, Vector, Vector], ...] = field(init=False, repr=False)  # (end time, from, velocity)

    def __post_init__(self) -> None:
        corners = (ZERO, *self.points, *((ZERO,) if self.loop else ()))
        legs, end = [], 0.0
        for start, goal in pairwise(corners):
            length = distance(start, goal)
            if length > 0.0:
                end += length / self.speed
                legs.append((end, start, scale(subtract(goal, start), self.speed / length)))
        object.__setattr__(self, "_legs", tuple(legs))

    @property
    def fastest(self) -> float:
        """The highest |u_0|, m/s."""
        return self.speed

    def position(self, t: float) -> Vector:
        """Return the displacement from the start, m, world frame, at mission time t, s."""
        begin, start, velocity = self._leg(t)
        return add(start, scale(velocity, self._wrapped(t) - begin))

    def rate(self, t: float) -> Vector:
        """Return u_0, m/s, world frame."""
        return self._leg(t)[2] if t > 0.0 else ZERO

    def _wrapped(self, t: float) -> float:
        lap = self._legs[-1][0] if self._legs else 0.0
        return max(t, 0.0) % lap if self.loop and lap else max(t, 0.0)

    def _leg(self, t: float) -> tuple[float, Vector, Vector]:
        """Return the begin, the start and the velocity of the leg flown at t; after the last one, a stay at its end."""
        t, begin = self._wrapped(t), 0.0
        for end, start, velocity in self._legs:
            if t < end:
                return begin, start, velocity
            begin = end
        return begin, (self.points[-1] if not self.loop else ZERO), ZERO


@dataclass(frozen=True, slots=True)
class Timed(Frozen):
    """The path of the first rank of `frames`, at its times."""

    frames: KeyFrames

    @property
    def fastest(self) -> float:
        """The highest |u_0|, m/s."""
        spans = pairwise(self.frames.times[0])
        looks = [begin + k * (end - begin) / LOOKS for begin, end in spans for k in range(1, LOOKS)]
        return max([norm(self.rate(t)) for t in looks], default=0.0)

    def position(self, t: float) -> Vector:
        """Return the displacement from the start, m, world frame, at mission time t, s."""
        return subtract(self.frames.offset(0, max(t, 0.0)), self.frames.offset(0, 0.0))

    def rate(self, t: float) -> Vector:
        """Return u_0, m/s, world frame."""
        return self.frames.offset_rate(0, t) if t > 0.0 else ZERO


Trajectory = Constant | Circling | Waypoints | Timed
