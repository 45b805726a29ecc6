"""Statistics of runs: quantiles, and the confidence interval of a success rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite, sqrt

CONFIDENCE_Z = 1.959963984540054  # standard deviations that hold 95 %


def wilson(successes: int, runs: int, z: float = CONFIDENCE_Z) -> tuple[float, float]:
    """Return Wilson's score interval of a rate with `successes` in `runs`.

    (s + z^2/2 -+ z sqrt(s (n - s) / n + z^2/4)) / (n + z^2), E. B. Wilson, JASA 22 (1927).
    Raises ValueError for no runs, and for more successes than runs.
    """
    if not 0 <= successes <= runs or runs < 1:
        raise ValueError(f"{successes} of {runs} runs")
    centre = (successes + z * z / 2.0) / (runs + z * z)
    half = z / (runs + z * z) * sqrt(successes * (runs - successes) / runs + z * z / 4.0)
    low = 0.0 if successes == 0 else centre - half
    return low, 1.0 if successes == runs else centre + half


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
