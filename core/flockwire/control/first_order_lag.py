"""An airframe with first-order lag: its response to a velocity command, and the feed-forward for it.

lag v' + v = u(t − D),   x' = v        (lag = 0: v = u)
"""

from __future__ import annotations

from math import exp

from flockwire.domain.vector import Vector


def lagged(x: float, v: float, u: float, lag: float, dt: float) -> tuple[float, float]:
    """Return x (m or rad) and v (m/s or rad/s) of one axis after `dt` s of the command `u` (as v); `lag` in s.

    v(dt) = u + (v − u) e^(−dt/lag),   x(dt) = x + u dt + (v − u) lag (1 − e^(−dt/lag))
    """
    if not lag:
        return x + u * dt, u
    decay = exp(-dt / lag)
    excess = v - u
    return x + (u * dt + excess * (lag * (1.0 - decay))), u + excess * decay


def lead(rate_ahead: Vector, acceleration_ahead: Vector, lag: float) -> Vector:
    """Return the command that gives the airframe the reference's velocity when the command takes effect.

        lag v' + v = u(t − D)   and   v = r'   give   u(t) = r'(t + D) + lag r''(t + D)        (ours)

    `rate_ahead` and `acceleration_ahead` are r' (m/s) and r'' (m/s^2) at t + D, `lag` in s.
    """
    return (
        rate_ahead[0] + lag * acceleration_ahead[0],
        rate_ahead[1] + lag * acceleration_ahead[1],
        rate_ahead[2] + lag * acceleration_ahead[2],
    )


def stopping_reference(position_ahead: Vector, rate_ahead: Vector, lag: float) -> Vector:
    """Return the stopping point of an airframe that follows the reference.

        y_r = r(t + D) + lag r'(t + D)        (ours)

    With y that of the airframe, e_y = y − y_r and u = u_r − K e_y, the error obeys e_y' = −K e_y: lag and dead time
    are out of the loop. `position_ahead` is r (m), `rate_ahead` r' (m/s) at t + D, `lag` in s.
    """
    return (
        position_ahead[0] + lag * rate_ahead[0],
        position_ahead[1] + lag * rate_ahead[1],
        position_ahead[2] + lag * rate_ahead[2],
    )
