"""Laws that know no safety, `[control] law = "law_hostile:ToOnePoint"`: whatever a law does, the filter keeps clear.

Each wants the highest speed in every step. They estimate the leader by the first neighbour.
"""

from __future__ import annotations

from math import cos, pi, sin
from random import Random

from flockwire_core.law import (
    RELAYING,
    SECOND,
    ZERO,
    BodyKind,
    Decision,
    LawSettings,
    Motion,
    Observation,
    Parameters,
    Vector,
    norm,
    scale,
    subtract,
)


class Wish(Parameters):
    """What they want: a point, m; for each follower in turn a direction; the s for which random ones last."""

    point: tuple[float, float, float] = (0.0, 0.0, 1.0)
    ways: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0),)
    lasting: float = 0.5


class ToOnePoint:
    """Straight to one point, all of them."""

    information = RELAYING
    Parameters = Wish

    def __init__(self, settings: LawSettings) -> None:
        self.wish, self.number, self.speed = Wish.of(settings.parameters), settings.number, settings.speed
        self.chance = Random(f"hostile {settings.number}")
        self.began, self.chosen = -1, ZERO

    def step(self, observation: Observation) -> Decision:
        """Return the way at full speed."""
        leader = None
        for one in observation.heard[:1]:
            leader = one.content.after((observation.now - one.stamp) / SECOND)
        if observation.motion is None:
            return Decision(ZERO, leader)
        way = self.way(observation.motion, observation, observation.now)
        return Decision(scale(way, self.speed / max(norm(way), 1e-9)), leader)

    def way(self, motion: Motion, _: Observation, __: int) -> Vector:
        """Return the direction wanted."""
        return subtract(self.wish.point, motion.position)

    def lasts(self, now: int) -> bool:
        """Return whether the last choice lasts; begin a new one if not."""
        turn = round(now / SECOND / self.wish.lasting)
        same, self.began = turn == self.began, turn
        return same


class StraightOn(ToOnePoint):
    """Straight on, each its own way."""

    def way(self, motion: Motion, _: Observation, __: int) -> Vector:
        """Return its way."""
        return self.wish.ways[(self.number - 1) % len(self.wish.ways)]


class BangBang(StraightOn):
    """Its way, and back, in turn."""

    def way(self, motion: Motion, observation: Observation, now: int) -> Vector:
        """Return its way, every second time the opposite."""
        sign = 1.0 if round(now / SECOND / self.wish.lasting + 0.5 * self.number) % 2 else -1.0
        return scale(super().way(motion, observation, now), sign)


class Chance(ToOnePoint):
    """A random direction, changed now and then."""

    def way(self, motion: Motion, _: Observation, now: int) -> Vector:
        """Return the random direction."""
        if not self.lasts(now):
            heading = self.chance.uniform(-pi, pi)
            self.chosen = (cos(heading), sin(heading), self.chance.choice((0.0, 0.0, -0.5, 0.5)))
        return self.chosen


class Chase(ToOnePoint):
    """Into the nearest body; without one, to the point."""

    def way(self, motion: Motion, observation: Observation, now: int) -> Vector:
        """Return the direction of the nearest body that is no person."""
        near = [body.relative_position for body in observation.bodies if body.kind is not BodyKind.MOVER]
        return min(near, key=norm) if near else super().way(motion, observation, now)


class Graze(ToOnePoint):
    """Round the nearest body as close as it can, to one side or the other by its number."""

    def way(self, motion: Motion, observation: Observation, now: int) -> Vector:
        """Return the direction across the nearest body, and a little towards it."""
        near = [body.relative_position for body in observation.bodies]
        x, y, z = min(near, key=norm) if near else super().way(motion, observation, now)
        side = 2.0 if self.number % 2 else -2.0
        return (x - side * y, y + side * x, z)


class Slip(ToOnePoint):
    """Into the nearest body, and past it, to one side and to the other in turn, faster than others can see."""

    def way(self, motion: Motion, observation: Observation, now: int) -> Vector:
        """Return the direction of the nearest body, and twice as much across it: across it and upwards in turn."""
        near = [body.relative_position for body in observation.bodies if body.kind is not BodyKind.MOVER]
        x, y, z = min(near, key=norm) if near else super().way(motion, observation, now)
        turn = int(now / SECOND / self.wish.lasting) % 4
        side = 2.0 if turn < 2 else -2.0
        if turn % 2:
            return (x - side * y, y + side * x, z)
        return (x - side * z, y, z + side * x)
