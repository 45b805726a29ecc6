"""The lateral shift with which a place passes beside discs: their half-width, with ramps before and after."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

from flockwire_core.control.free_place import Disc
from flockwire_core.control.plane_polygon import Corner

_Beside = tuple[float, float, float]  # s, d and R of a disc, m

ROUNDING = 0.05  # m over which the way out to a ramp is rounded


def half_width(along: float, radius: float, slope: float) -> float:
    """Return the half-width w, m, of a disc with ramps, at `along` s, m from its centre.

        w(s) = sqrt(R^2 − s^2)                         for |s| <= s_1 = R m / sqrt(1 + m^2)
        w(s) = sqrt(R^2 − s_1^2) − m (|s| − s_1)       beyond, negative in the end        (ours)

    The ramps are tangents of `slope` m to the circle of `radius` R: w is continuously differentiable, |w'| <= m.
    """
    root = sqrt(1.0 + slope * slope)
    knee, s = radius * slope / root, abs(along)
    return sqrt(radius * radius - s * s) if s <= knee else radius / root - slope * (s - knee)


def rounded(excess: float) -> float:
    """Return max(0, x), rounded to be continuously differentiable, for `excess` x, m; never less than it.

    f(x) = 0 for x <= −b,   (x + b)^2 / 4 b   in between,   x for x >= b
    """
    if excess <= -ROUNDING:
        return 0.0
    return excess if excess >= ROUNDING else (excess + ROUNDING) ** 2 / (4.0 * ROUNDING)


def lateral_shift(
    place: Corner, along: Corner, discs: Sequence[Disc], side: float, slope: float, early: float = 0.0
) -> tuple[float, float]:
    """Return the shift x of a place beside `discs`, m, and the largest, X, that it will need.

        x = max_k f(w(s_k) − d_k),   X = max_k R_k − d_k        (ours)

    `place` (m) moves along the unit vector `along`. s_k is its position along it and d_k that to the `side` (+1: left,
    −1: right) of disc k. Only those discs count that the place's line crosses, and those into which the shift beside
    them leads, now or abreast of them. Both are 0 if there are none. The shift is reached `early`, m,
    before the discs: s_k + early counts in place of s_k < 0, but 0 at most.
    """
    (px, py), (ux, uy), own, others = place, along, list[_Beside](), list[_Beside]()
    for cx, cy, r in discs:
        x, y = px - cx, py - cy
        s, d = ux * x + uy * y, side * (ux * y - uy * x)
        if s < r + (2.0 * r + ROUNDING) / slope:  # not passed
            s = max(min(s + early, 0.0), s)
            (own if abs(d) < r else others).append((s, d, r))
    while own and (joining := [one for one in others if _leads_into(one, own, slope)]):
        own.append(joining[0])
        others.remove(joining[0])
    return _shift(own, 0.0, slope), max([r - d for _, d, r in own], default=0.0)


def _shift(discs: Sequence[_Beside], moved: float, slope: float) -> float:
    """Return the shift beside `discs` of a place that has moved on by `moved`, m."""
    return max([rounded(half_width(s + moved, r, slope) - d) for s, d, r in discs], default=0.0)


def _leads_into(disc: _Beside, own: Sequence[_Beside], slope: float) -> bool:
    """Return whether the shift beside `own` leads the place into `disc`, now or where it is abreast of it."""
    s, d, r = disc
    return any(hypot(s + moved, d + _shift(own, moved, slope)) < r for moved in (0.0, max(-s, 0.0)))
