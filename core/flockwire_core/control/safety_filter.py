"""The safety filter: the nearest velocity to the wanted one that satisfies every half-space and stays in a ball."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final

from flockwire_core.domain.vector import ZERO, Vector

HalfSpace = tuple[float, float, float, float]
"""(n_x, n_y, n_z, b): the velocities v with n·v >= b, |n| = 1, b in m/s."""

_TOLERANCE: Final = 1e-12  # m/s, tolerance of a half-space for rounding
_PARALLEL = 1e-9  # sine of the angle below which two planes count as parallel
_RELAXED: Final = 4e-12  # m/s by which a kept half-space is relaxed for rounding


def nearest_velocity(
    wanted: Vector, half_spaces: Sequence[HalfSpace], radius: float, centre: Vector = ZERO, ranks: Sequence[int] = ()
) -> tuple[Vector, float]:
    """Return the velocity v, m/s, and the largest violation t >= 0, m/s, that it could not avoid.

        minimise |v − wanted|   subject to   n_k·v >= b_k − t_r,   |v − centre| <= radius        (ours)

    with t_r, for the half-spaces of rank r, the smallest for which such a velocity exists, first for the lowest rank,
    then for the next: no rank is violated for a higher one. All are 0 as long as the half-spaces and the ball have a
    common point. Without `ranks` all are of one.
    The half-spaces are added one by one. If one is violated, the solution is on its plane, and there, again one by one,
    on the line of two planes or at the point of three: exact, in linear time on average.
    """
    cx, cy, cz = centre
    shifted = [(x, y, z, b - x * cx - y * cy - z * cz) for x, y, z, b in half_spaces]
    goal = (wanted[0] - cx, wanted[1] - cy, wanted[2] - cz)
    v, failed = _solve(goal, False, shifted, radius)
    violation = 0.0
    if failed < len(shifted):
        kept: list[HalfSpace] = []
        ranks = ranks or [0] * len(shifted)
        for rank in sorted(set(ranks)):
            planes = [plane for plane, own in zip(shifted, ranks, strict=True) if own == rank]
            v, least = _least_violation(planes, kept, radius)
            violation = max(violation, least)
            kept += [(x, y, z, b - least - _RELAXED) for x, y, z, b in planes]
        nearest, failed = _solve(goal, False, kept, radius)
        if failed == len(kept):
            v = nearest
    return (v[0] + cx, v[1] + cy, v[2] + cz), violation


def _solve(goal: Vector, ahead: bool, planes: Sequence[HalfSpace], radius: float) -> tuple[Vector, int]:
    """Return the best point of the ball and the index of the first impossible plane (their number if none).

    Best is the nearest to `goal`, or with `ahead` the farthest in the direction `goal`. After a failure the point is
    the best for the planes before the one that failed.
    """
    v = _clip(goal, radius, ahead)
    for i, plane in enumerate(planes):
        x, y, z, b = plane
        if x * v[0] + y * v[1] + z * v[2] < b - _TOLERANCE:
            found = _on_plane(goal, ahead, planes, i, radius)
            if found is None:
                return v, i
            v = found
    return v, len(planes)


def _clip(goal: Vector, radius: float, ahead: bool) -> Vector:
    x, y, z = goal
    length = sqrt(x * x + y * y + z * z)
    if length == 0.0 or (length <= radius and not ahead):
        return goal
    factor = radius / length
    return (x * factor, y * factor, z * factor)


def _on_plane(goal: Vector, ahead: bool, planes: Sequence[HalfSpace], i: int, radius: float) -> Vector | None:
    """Return the best point on plane i that satisfies the planes before it, None if there is none."""
    nx, ny, nz, b = planes[i]
    square = radius * radius - b * b
    if square < 0.0:
        return None
    across = nx * goal[0] + ny * goal[1] + nz * goal[2]
    gx, gy, gz = goal[0] - across * nx, goal[1] - across * ny, goal[2] - across * nz
    length, disc = sqrt(gx * gx + gy * gy + gz * gz), sqrt(square)
    if length > disc or (ahead and length > _PARALLEL):
        factor = disc / length
        gx, gy, gz = gx * factor, gy * factor, gz * factor
    elif ahead:
        gx = gy = gz = 0.0
    v = (gx + b * nx, gy + b * ny, gz + b * nz)
    for j in range(i):
        x, y, z, c = planes[j]
        if x * v[0] + y * v[1] + z * v[2] < c - _TOLERANCE:
            found = _on_line(goal, ahead, planes, i, j, radius)
            if found is None:
                return None
            v = found
    return v


def _on_line(goal: Vector, ahead: bool, planes: Sequence[HalfSpace], i: int, j: int, radius: float) -> Vector | None:
    """Return the best point on the line of planes i and j that satisfies the planes before j, None without one."""
    ax, ay, az, a = planes[i]
    bx, by, bz, b = planes[j]
    dx, dy, dz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    sine = sqrt(dx * dx + dy * dy + dz * dz)
    if sine < _PARALLEL:
        return None
    dx, dy, dz = dx / sine, dy / sine, dz / sine
    cosine = ax * bx + ay * by + az * bz
    p, q = (a - cosine * b) / (sine * sine), (b - cosine * a) / (sine * sine)
    px, py, pz = p * ax + q * bx, p * ay + q * by, p * az + q * bz  # the line's point nearest to the centre
    square = radius * radius - px * px - py * py - pz * pz
    if square < 0.0:
        return None
    high = sqrt(square)
    low = -high
    for k in range(j):
        x, y, z, c = planes[k]
        slope, lack = x * dx + y * dy + z * dz, c - x * px - y * py - z * pz
        if abs(slope) < _PARALLEL:
            if lack > _TOLERANCE:
                return None
        elif slope > 0.0:
            low = max(low, lack / slope)
        else:
            high = min(high, lack / slope)
    if low > high + _TOLERANCE:
        return None
    along = dx * goal[0] + dy * goal[1] + dz * goal[2]
    t = (high if along > 0.0 else low) if ahead else min(max(along, low), high)
    return (px + t * dx, py + t * dy, pz + t * dz)


def _least_violation(planes: Sequence[HalfSpace], kept: list[HalfSpace], radius: float) -> tuple[Vector, float]:
    """Return the point of the ball whose largest violation of `planes` is least, and that violation.

    It satisfies all that is `kept`. If plane i is violated by more than all before it, it is the worst one at the new
    best point: the farthest point along n_i that violates no earlier plane j more than plane i.

        b_j − n_j·v <= b_i − n_i·v
    """
    v, failed = _solve(ZERO, False, [*kept, *planes], radius)
    worst = 0.0
    for i in range(max(failed - len(kept), 0), len(planes)):
        x, y, z, b = planes[i]
        if b - x * v[0] - y * v[1] - z * v[2] <= worst + _TOLERANCE:
            continue
        bisectors = kept.copy()
        for ox, oy, oz, c in planes[:i]:
            mx, my, mz = ox - x, oy - y, oz - z
            length = sqrt(mx * mx + my * my + mz * mz)
            if length > _PARALLEL:
                bisectors.append((mx / length, my / length, mz / length, (c - b) / length))
        found, failed = _solve((x, y, z), True, bisectors, radius)
        if failed == len(bisectors):
            v = found
        worst = max(worst, b - x * v[0] - y * v[1] - z * v[2])
    return v, worst
