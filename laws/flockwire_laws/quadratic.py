"""A strictly convex quadratic program, by the dual active-set method.

D. Goldfarb, A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs", Mathematical
Programming 27, 1983.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TOLERANCE = 1e-9  # of a row that counts as kept
PARALLEL = 1e-12  # of a step that does not move the point


def minimise(hessian: Array, gradient: Array, rows: Array, limits: Array, most: int = 500) -> Array | None:
    """Return the x, shape (n,), that minimises x'H x/2 + g'x with rows x >= limits; None if there is none.

    `hessian` is positive definite, (n, n), `rows` (m, n), `limits` (m,). It starts at the free minimum and adds the row
    that is violated most, until none is; a row whose multiplier reaches 0 is dropped.
    """
    inverse = np.linalg.inv(hessian)
    x, multipliers = -inverse @ gradient, np.zeros(0)
    active: list[int] = []
    for _ in range(most):
        slack = rows @ x - limits
        worst = int(np.argmin(slack)) if len(slack) else 0
        if not len(slack) or slack[worst] >= -TOLERANCE * (1.0 + abs(limits[worst])):
            return x
        added = 0.0
        while True:
            normal, kept = rows[worst], rows[active]
            towards = inverse @ normal
            change = np.linalg.solve(kept @ inverse @ kept.T, kept @ towards) if active else np.zeros(0)
            step = towards - inverse @ kept.T @ change if active else towards
            along = float(step @ normal)
            falling = np.flatnonzero(change > PARALLEL)
            first = falling[np.argmin(multipliers[falling] / change[falling])] if len(falling) else -1
            until = multipliers[first] / change[first] if first >= 0 else np.inf
            full = (limits[worst] - rows[worst] @ x) / along if along > PARALLEL * float(normal @ towards) else np.inf
            length = min(until, full)
            if length == np.inf:
                return None
            multipliers, added = multipliers - length * change, added + length
            if full < np.inf:
                x = x + length * step
            if length == full:
                active, multipliers = [*active, worst], np.append(multipliers, added)
                break
            del active[first]
            multipliers = np.delete(multipliers, first)
    return None
