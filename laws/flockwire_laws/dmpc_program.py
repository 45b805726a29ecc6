"""A plan of `law = "dmpc"`, and its quadratic program, in the plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flockwire_core.law import SECOND

from flockwire_laws.quadratic import minimise
from flockwire_laws.relative import Array, size

K, H = 15, 0.2  # points of a plan, s between two
TIMES = H * np.arange(1, K + 1)
REACH = np.array([[H * H * (k - m + 0.5) if m <= k else 0.0 for m in range(K)] for k in range(K)])
CHANGE = np.eye(K) - np.eye(K, k=-1)


class Plan(NamedTuple):
    """From `start` (Unix ns) on: a[0..K−1], m/s^2, and p[1..K], m, each (K, 2)."""

    start: int
    accelerations: Array
    positions: Array


def sample(plan: Plan, now: int) -> Array:
    """Return a at `now`; after the last it is 0."""
    k = (now - plan.start) // round(H * SECOND)
    return np.asarray(plan.accelerations[max(k, 0)] if k < K else np.zeros(2))


def shifted(points: Array, start: int, to: int) -> Array:
    """Return the points p[1..K] of a plan that starts `to` instead, the last one held."""
    at = (to - start) / SECOND + TIMES
    return np.column_stack([np.interp(at, TIMES, points[:, axis]) for axis in (0, 1)])


def solve(
    a_max: float, r_min: float, free: Array, goal: Array, before: Array, own: Array, others: list[Array]
) -> Array:
    """Return a[0..K−1], (K, 2), for the free motion `free` (K, 2) and the last acceleration `before`."""
    near = [np.linalg.norm(own - other, axis=1) for other in others]
    meets = [k for k in range(K) if any(one[k] < r_min for one in near)]
    k_c = meets[0] if meets else K
    rows = [other[k_c] for other, one in zip(others, near, strict=True) if meets and one[k_c] < 3 * r_min]
    q, s = (1e3, 100.0) if rows else (1e4 if size(2.0 * free[0] - free[1] - goal) < 1.0 else 1e3, 10.0)
    n, count = 2 * K, len(rows)
    end, change = np.kron(REACH[-1:], np.eye(2)), np.kron(CHANGE, np.eye(2))
    hessian, gradient = 2.0 * np.eye(n + count), np.zeros(n + count)
    hessian[:n, :n] += 2.0 * (q * end.T @ end + s * change.T @ change)
    gradient[:n] = 2.0 * q * end.T @ (free[-1] - goal)
    gradient[:2] -= 2.0 * s * before
    gradient[n:] = -5e4
    matrix, limits = [*np.eye(n, n + count), *-np.eye(n + count)], [-a_max] * (2 * n) + [0.0] * count
    for j, other in enumerate(rows):
        normal = (own[k_c] - other) / max(size(own[k_c] - other), 1e-6)
        row = np.zeros(n + count)
        row[:n], row[n + j] = np.kron(REACH[k_c], np.eye(2)).T @ normal, -1.0
        matrix, limits = [*matrix, row], [*limits, r_min - normal @ (free[k_c] - other)]
    found = minimise(hessian, gradient, np.array(matrix), np.array(limits))
    return (np.zeros(n) if found is None else found[:n]).reshape(K, 2)
