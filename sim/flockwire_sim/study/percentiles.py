"""Which value half, 95 %, 99 % and all of the runs keep to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite

SHARES = (0.50, 0.95, 0.99)


@dataclass(frozen=True, slots=True)
class Spread:
    """Values that half, 95 %, 99 % and all of the runs keep to; None where some of these have no value at all."""

    p50: float | None
    p95: float | None
    p99: float | None
    worst: float | None
    worst_seed: int


def spread(values: Sequence[tuple[int, float | None]], high_is_bad: bool) -> Spread | None:
    """Return the spread of (seed, value); a missing value counts as the worst. None when no run has one."""
    if all(value is None for _, value in values):
        return None
    sign = 1.0 if high_is_bad else -1.0
    ranked = sorted((inf if value is None else sign * value, seed) for seed, value in values)
    kept = [ranked[ceil(share * len(ranked) - 1e-9) - 1][0] for share in SHARES]
    p50, p95, p99, worst = (sign * value if isfinite(value) else None for value in (*kept, ranked[-1][0]))
    return Spread(p50, p95, p99, worst, ranked[-1][1])
