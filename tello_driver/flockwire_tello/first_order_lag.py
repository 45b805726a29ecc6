"""The answer of one axis to a velocity command, solved exactly while the command stays the same.

lag v' + v = u,   x' = v        (lag = 0: v = u)
"""

from __future__ import annotations

from math import exp


def lagged(x: float, v: float, u: float, lag: float, dt: float) -> tuple[float, float]:
    """Return x (m or rad) and v (m/s or rad/s) after `dt` s under the command `u` (as v), with `lag` s.

    v(dt) = u + (v − u) e^(−dt/lag),   x(dt) = x + u dt + (v − u) lag (1 − e^(−dt/lag))
    """
    if not lag:
        return x + u * dt, u
    decay = exp(-dt / lag)
    excess = v - u
    return x + (u * dt + excess * (lag * (1.0 - decay))), u + excess * decay
