"""The deadlock breaker: a blocked drone turns to one side, every drone to the same side."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, pi, sin
from typing import Final, NamedTuple

from flockwire_core.domain.body import Body, BodyKind, Separation, to_surface
from flockwire_core.domain.vector import ZERO, Vector, norm, scale

_PROGRESS: Final = 0.1  # m of approach to the goal that count as progress


class SidestepParameters(NamedTuple):
    """The safety distances, and the gap beyond them below which a body blocks, m."""

    separation: Separation
    reach: float


def sidestep(
    wanted: Vector, bodies: Sequence[Body], parameters: SidestepParameters, side: float, velocity: Vector = ZERO
) -> Vector:
    """Return `wanted`, m/s, rotated about Z away from blocking bodies.

        theta = (pi/2) max_k  s_k max(0, −û·n_k − max(0, −n_k·(v_k − v)) / |w|)        (ours)
        s_k = clamp(2 (1 − g_k / reach), 0, 1)

    n_k is the unit vector from body k's surface to us, g_k the gap in m beyond the distance to keep from it; bodies
    farther than `reach` do not block. w = `wanted` is relative to a goal that moves at v = `velocity`, m/s: a drone
    that flies ahead as fast as we want to blocks nobody. `side` +1 turns to the right, −1 to the left. Two drones that
    meet head on turn to the same side and pass; many that meet in one place circle as in a roundabout.
    """
    speed = hypot(wanted[0], wanted[1])
    if speed < 1e-6:
        return wanted
    ux, uy = wanted[0] / speed, wanted[1] / speed
    blocked, reach, drone, (gx, gy, _) = 0.0, parameters.reach, BodyKind.DRONE, velocity
    drone_distance, obstacle_distance = parameters.separation
    for body in bodies:
        away = to_surface(body.relative_position, body.radius)
        distance, yields = norm(away), body.kind is drone
        gap = distance - (drone_distance if yields else obstacle_distance)
        if gap < reach:
            nx, ny, _ = scale(away, -1.0 / max(distance, 1e-9))
            near = min(2.0 * (1.0 - gap / reach), 1.0)
            closing = -(ux * nx + uy * ny)
            if yields and closing > 0.0:
                vx, vy, _ = body.velocity
                closing -= max(-nx * (vx - gx) - ny * (vy - gy), 0.0) / speed
            blocked = max(blocked, near * closing)
    if blocked <= 0.0:
        return wanted
    angle = -side * 0.5 * pi * blocked
    c, s = cos(angle), sin(angle)
    return (c * wanted[0] - s * wanted[1], s * wanted[0] + c * wanted[1], wanted[2])


class Sidestep:
    """Rotates a drone's corrections around bodies; changes the side after `switch_after` s without progress."""

    def __init__(self, parameters: SidestepParameters, switch_after: float) -> None:
        self._parameters, self._switch_after = parameters, switch_after
        self._best = self._since = 0.0  # m to go, and the time, s, of the last progress
        self.side = 1.0

    def turned(
        self, correction: Vector, bodies: Sequence[Body], to_go: float, now: float, velocity: Vector = ZERO
    ) -> Vector:
        """Return `correction`, m/s, rotated around `bodies`; a decrease of `to_go`, m, is progress; `now` in s.

        The goal moves at `velocity`, m/s.
        """
        turned = sidestep(correction, bodies, self._parameters, self.side, velocity)
        if turned == correction:
            self.side, self._best, self._since = 1.0, to_go, now
        elif to_go < self._best - _PROGRESS:
            self._best, self._since = to_go, now
        elif now - self._since > self._switch_after:
            self.side, self._best, self._since = -self.side, to_go, now
        return turned
