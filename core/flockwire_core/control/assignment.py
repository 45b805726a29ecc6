"""The optimal assignment of drones to places."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf


def assignment(now: Sequence[Sequence[float]], then: Sequence[Sequence[float]]) -> tuple[int, ...]:
    """Return for each of `now` its index in `then`, another for each, with the least sum of squared distances.

    Both are m, one axis system, `then` at least as long as `now` (else ValueError). Moving all of `now`, or all of
    `then`, by one vector changes no assignment of equally many. Points that go straight there with a common sigma then
    keep, of the smaller of the least distances in `now` and `then`, at least 1 / sqrt(2): (a_i − a_j)·(b_i − b_j) >= 0
    for any two.
    """
    return least_cost([[sum((a - b) ** 2 for a, b in zip(x, y, strict=True)) for y in then] for x in now])


def least_cost(costs: Sequence[Sequence[float]]) -> tuple[int, ...]:
    """Return for each row its column, another for each, with the least sum of costs; needs as many columns as rows.

    Shortest augmenting paths with reduced costs c_ij − u_i − v_j >= 0 (Kuhn 1955; Jonker and Volgenant 1987), O(N^3).
    Raises ValueError with fewer columns than rows.
    """
    columns = len(costs[0]) if costs else 0
    if columns < len(costs):
        raise ValueError(f"{len(costs)} rows have {columns} columns: must be as many or more")
    taken: list[int] = [-1] * columns  # the row of each column
    u, v = [0.0] * len(costs), [0.0] * columns
    for row in range(len(costs)):
        _augment(costs, row, taken, u, v)
    found = {i: j for j, i in enumerate(taken) if i >= 0}
    return tuple(found[i] for i in range(len(costs)))


def _augment(costs: Sequence[Sequence[float]], row: int, taken: list[int], u: list[float], v: list[float]) -> None:
    """Give `row` a column along the shortest augmenting path; rows on the path change theirs."""
    shortest, before = [inf] * len(v), [-1] * len(v)  # reduced length of the path to each column; column before it
    left = set(range(len(v)))
    i, at, length = row, -1, 0.0
    while i >= 0:
        mine, potential, nearest = costs[i], u[i], -1
        for j in left:
            reduced = length + mine[j] - potential - v[j]
            if reduced < shortest[j]:
                shortest[j], before[j] = reduced, at
            if nearest < 0 or shortest[j] < shortest[nearest]:
                nearest = j
        left.discard(nearest)
        at, length, i = nearest, shortest[nearest], taken[nearest]
    u[row] += length
    for j in range(len(v)):
        if j not in left and j != at:
            u[taken[j]] += length - shortest[j]
            v[j] -= length - shortest[j]
    while at >= 0:
        previous = before[at]
        taken[at] = row if previous < 0 else taken[previous]
        at = previous
