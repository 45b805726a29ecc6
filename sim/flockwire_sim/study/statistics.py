"""Statistics of runs: quantiles, and the confidence interval of a success rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite

from scipy.stats import binomtest


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % score interval of a rate with `successes` in `runs`, 1 or more (E. B. Wilson, JASA 22, 1927)."""
    interval = binomtest(successes, runs).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


SHARES = (0.50, 0.95, 0.99)


@dataclass(frozen=True, slots=True)
class Quantiles:
    """Bounds that half, 95 %, 99 % and all of the runs keep; None if some of these have no value."""

    p50: float | None
    p95: float | None
    p99: float | None
    worst: float | None
    worst_seed: int


def quantiles(values: Sequence[tuple[int, float | None]], high_is_bad: bool) -> Quantiles | None:
    """Return the quantiles of (seed, value); a missing value counts as the worst. None when no run has one."""
    if all(value is None for _, value in values):
        return None
    sign = 1.0 if high_is_bad else -1.0
    ranked = sorted((inf if value is None else sign * value, seed) for seed, value in values)
    kept = [ranked[ceil(share * len(ranked) - 1e-9) - 1][0] for share in SHARES]
    p50, p95, p99, worst = (sign * value if isfinite(value) else None for value in (*kept, ranked[-1][0]))
    return Quantiles(p50, p95, p99, worst, ranked[-1][1])
