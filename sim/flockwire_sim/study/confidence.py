"""How sure one may be of a share of which a few runs were seen."""

from __future__ import annotations

from math import sqrt

CONFIDENCE_Z = 1.959963984540054  # standard deviations that hold 95 %


def wilson(successes: int, runs: int, z: float = CONFIDENCE_Z) -> tuple[float, float]:
    """Return Wilson's score interval for a share of which `successes` of `runs` were seen.

    (s + z^2/2 -+ z sqrt(s (n - s) / n + z^2/4)) / (n + z^2), E. B. Wilson, JASA 22 (1927).
    Raises ValueError for no runs, and for more successes than runs.
    """
    if not 0 <= successes <= runs or runs < 1:
        raise ValueError(f"{successes} of {runs} runs")
    centre = (successes + z * z / 2.0) / (runs + z * z)
    half = z / (runs + z * z) * sqrt(successes * (runs - successes) / runs + z * z / 4.0)
    low = 0.0 if successes == 0 else centre - half
    return low, 1.0 if successes == runs else centre + half
