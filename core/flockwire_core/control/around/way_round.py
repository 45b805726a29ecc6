"""The way round bodies that stand between a drone and its goal: the turns to the left and to the right."""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2, cos, hypot, pi, remainder, sin, tau
from typing import Final

from flockwire_core.control.around.bent_place import DetourParameters, stands
from flockwire_core.control.around.free_place import Disc
from flockwire_core.control.plane_polygon import Corner
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import Vector, subtract

SPARE: Final = 0.02  # m beyond the kept distance
TOUCH = 0.01  # m by which a straight way may touch a disc
NEAR = 0.15  # m from its place within which a drone flies straight
TOGETHER = (0.2, 0.4)  # m/s, relative speed below which a drone stands in the formation: at first, and once it does
SHORTER = 0.6  # rad by which the other side's turn must be smaller
TIE = 0.1  # rad within which two turns count as equal: then all drones take the right one
CLOSED = 0.95 * pi  # rad: a turn that leads back
WAITS = 0.5 * pi  # rad: likewise in a gap behind a drone, until its patience ends: the other one may give way
ADVANCE = 0.6  # m of motion that count as progress
APPROACH = 0.1  # m, likewise, nearer to the place
ROUND = 4.0  # times the patience for a way that leads no nearer
BEFORE = 0.6  # m beyond the kept distance within which a drone ahead is stood before
MOST_GIVEN_WAY = 4  # times that a drone flies back longer than before
BERTH = 0.2  # m more, at which a drone passes where the turn is small: near others the safety filter slows it down
EASY = (0.7, 0.9)  # rad, the largest of these turns: at first, and once it passes so
LOOK_AHEAD = 3.0  # s, at most, for which the place's motion is continued past an obstacle
BACK = 0.8 * pi  # rad: the turn of a drone that gives way


def widened(disc: Disc, goal: Corner) -> Disc:
    """Return `disc` with BERTH more radius, as far as the origin and `goal`, m, stay outside."""
    x, y, r = disc
    return (x, y, max(r, min(r + BERTH, hypot(x, y), hypot(goal[0] - x, goal[1] - y))))


def is_straight(goal: Corner, discs: Sequence[Disc]) -> bool:
    """Return whether the straight way from the origin to `goal`, m, is outside all discs."""
    gx, gy = goal
    square = gx * gx + gy * gy
    for x, y, r in discs:
        along = x * gx + y * gy
        if along <= 0.0:
            continue
        t = min(along / square, 1.0)
        dx, dy = x - t * gx, y - t * gy
        near = max(r - TOUCH, 0.0)
        if dx * dx + dy * dy < near * near:
            return False
    return True


def turns(goal: Corner, discs: Sequence[Disc]) -> tuple[float, float]:
    """Return the smallest turns from the direction of `goal` to a free direction, left and right, rad, at most pi.

        disc k covers the directions  |theta − phi_k| < asin(min(1, R_k / rho_k))        (ours)

    `goal` and the discs are relative to the drone, m; (rho_k, phi_k) is disc k's centre. Directions that overlapping
    discs cover are turned past together; discs beyond the goal do not count.
    """
    gx, gy = goal
    reach, ahead = hypot(gx, gy), atan2(gy, gx)
    covered = []
    for x, y, r in discs:
        rho = hypot(x, y)
        if rho < reach + r:
            covered.append((remainder(atan2(y, x) - ahead, tau), asin(min(1.0, r / rho)) if rho > 0.0 else 0.5 * pi))
    return _past(covered, 1.0), _past(covered, -1.0)


def _past(covered: list[tuple[float, float]], sign: float) -> float:
    turn, more = 0.0, True
    while more and turn < pi:
        more = False
        for phi, half in covered:
            behind = remainder(sign * phi - turn, tau)
            if abs(behind) < half - 1e-9:
                turn += behind + half
                more = True
    return min(turn, pi)


class WayRound:
    """Turns one drone's corrections round what stands in its way; `patience` in s, different for every drone.

    Without progress for its patience a drone tries the other side or, if it stands before another drone, flies back for
    half of it, and longer each time. The drone with the shortest patience gives way, the others find the way free.
    """

    def __init__(self, parameters: DetourParameters, patience: float) -> None:
        self._parameters, self._patience = parameters, patience
        self._kept = parameters.separation.drone + SPARE  # m from another drone
        self._side = 0.0  # +1 left, -1 right, 0 none
        self._anchor, self._nearest = (0.0, 0.0), 0.0  # m to go at the last progress, seen from the formation
        self._moved = self._neared = self._kept_until = self._back_until = 0.0  # s
        self._given_way = self._changes = 0
        self._gives_berth = False
        self._in_gap = False  # whether it is behind a drone, with obstacles in sight

    def turned(
        self, correction: Vector, motion: Motion, velocity: Vector, to_go: Corner, bodies: Sequence[Body], now: float
    ) -> tuple[Vector, Sequence[Body]]:
        """Return `correction`, m/s, turned round what stands in the way, and the bodies that were not considered.

        `to_go` leads from the stopping point to the place, m, which moves at `velocity`, m/s; `now` in s. Obstacles
        stand, and drones that move with the place.
        """
        if hypot(*to_go) < NEAR:
            self._given_way = self._changes = 0
            self._straight(to_go, now)
            return correction, bodies
        discs, others, behind_drone = self._standing(motion, velocity, to_go, bodies)
        if discs and not self._in_gap and now >= self._back_until:
            discs = self._with_berth(to_go, discs)
        if now >= self._back_until and (not discs or is_straight(to_go, discs)):
            if self._in_gap:
                self._side = 0.0
                self._progress(to_go, now)
            else:
                self._straight(to_go, now)
            return correction, others
        left, right = turns(to_go, discs)
        if now >= self._back_until:
            self._progress(to_go, now)
            self._choose(left, right, behind_drone, now)
        turn = self._side * (left if self._side > 0.0 else right)
        if now < self._back_until:
            turn = self._side * BACK
        elif abs(turn) > CLOSED or (self._in_gap and not self._given_way and min(left, right) > WAITS):
            return correction, others
        c, s = cos(turn), sin(turn)
        x, y, z = correction
        return (c * x - s * y, s * x + c * y, z), others

    def _with_berth(self, to_go: Corner, discs: list[Disc]) -> list[Disc]:
        """Return `discs` widened, if the way round them is hardly longer then, else as they are."""
        wide = [widened(disc, to_go) for disc in discs]
        self._gives_berth = is_straight(to_go, wide) or min(turns(to_go, wide)) < EASY[self._gives_berth]
        return wide if self._gives_berth else discs

    def _straight(self, to_go: Corner, now: float) -> None:
        self._side, self._anchor, self._nearest = 0.0, to_go, hypot(*to_go)
        self._moved = self._neared = now

    def _standing(
        self, motion: Motion, velocity: Vector, to_go: Corner, bodies: Sequence[Body]
    ) -> tuple[list[Disc], list[Body], bool]:
        """Return what stands around, relative to the stopping point, the other bodies, and whether a drone is ahead.

        An obstacle stands where it will be, seen from the place, when the drone is there: by v (rho − R) / v_max
        farther back.
        """
        origin = ox, oy, _ = subtract(motion.position, motion.stopping)
        (gx, gy), (vx, vy, _), kept = to_go, velocity, self._kept
        discs: list[Disc] = []
        others: list[Body] = []
        drones = walled = False
        reach, together = hypot(gx, gy), TOGETHER[self._in_gap and self._side != 0.0]
        kind = BodyKind.DRONE
        for body in bodies:
            if body.kind is not kind:
                if stands(body):
                    x, y, r = self._parameters.disc(body, origin, SPARE)
                    early = min(max(hypot(x, y) - r, 0.0) / self._parameters.speed, LOOK_AHEAD)
                    discs.append((x - early * vx, y - early * vy, r))
                    walled = True
                else:
                    others.append(body)
                continue
            (rx, ry, _), (wx, wy, _) = body.relative_position, body.velocity
            x, y, wx, wy = ox + rx, oy + ry, wx - vx, wy - vy
            if (gx - x) * (gx - x) + (gy - y) * (gy - y) < kept * kept:
                others.append(body)
                continue
            ahead = x * gx + y * gy
            if ahead > 0.0 and not drones:
                gap = hypot(x, y)
                drones = gap < kept + BEFORE and ahead > 0.7 * gap * reach
            if wx * wx + wy * wy > together * together:
                others.append(body)
            else:
                discs.append((x, y, kept))
        self._in_gap = drones and walled
        return discs, others, drones

    def _progress(self, to_go: Corner, now: float) -> None:
        """Note the time at which the drone has moved, or has come nearer to its place."""
        reach = hypot(*to_go)
        if hypot(to_go[0] - self._anchor[0], to_go[1] - self._anchor[1]) > ADVANCE:
            self._anchor, self._moved = to_go, now
        if reach < self._nearest - APPROACH:
            self._nearest, self._moved, self._neared = reach, now, now

    def _choose(self, left: float, right: float, behind_drone: bool, now: float) -> None:
        """Choose the side of the smaller turn, or another way after `patience` without progress."""
        if self._side == 0.0:
            self._side = 1.0 if left < right - TIE else -1.0
            return
        kept, other = (left, right) if self._side > 0.0 else (right, left)
        if now - self._moved > self._patience or now - self._neared > ROUND * self._patience:
            self._side, self._moved, self._neared = -self._side, now, now
            self._keep(now)
            if behind_drone:
                self._given_way = min(self._given_way + 1, MOST_GIVEN_WAY)
                self._back_until = now + 0.5 * self._patience * self._given_way
        elif (now > self._kept_until or (kept > CLOSED and other < WAITS)) and other < kept - SHORTER:
            self._side = -self._side
            self._keep(now)

    def _keep(self, now: float) -> None:
        """Keep the side, longer each time: at a wall that is only partly in sight the sides would alternate."""
        self._changes += 1
        self._kept_until = now + 2.0 * self._patience * self._changes
