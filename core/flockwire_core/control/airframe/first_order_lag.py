"""An airframe with first-order lag and dead time: its answer to a command, what leads it, which gains suit it.

lag v' + v = u(t − D),   x' = v        (lag = 0: v = u)
"""

from __future__ import annotations

from math import atan, exp, inf, pi, sqrt

from flockwire_core.domain.vector import Vector


def lagged(x: float, v: float, u: float, lag: float, dt: float) -> tuple[float, float]:
    """Return x (m or rad) and v (m/s or rad/s) of one axis after `dt` s of the command `u` (as v); `lag` in s.

    v(dt) = u + (v − u) e^(−dt/lag),   x(dt) = x + u dt + (v − u) lag (1 − e^(−dt/lag))
    """
    if not lag:
        return x + u * dt, u
    decay = exp(-dt / lag)
    excess = v - u
    return x + (u * dt + excess * (lag * (1.0 - decay))), u + excess * decay


def lagged_motion(x: Vector, v: Vector, u: Vector, lag: float, dt: float) -> tuple[Vector, Vector]:
    """Return x (m) and v (m/s) after `dt` s of the command `u` (m/s), each axis as `lagged`; `lag` in s."""
    px, py, pz = x
    ux, uy, uz = u
    if not lag:
        return (px + ux * dt, py + uy * dt, pz + uz * dt), u
    decay = exp(-dt / lag)
    drift = lag * (1.0 - decay)
    ex, ey, ez = v[0] - ux, v[1] - uy, v[2] - uz
    position = (px + (ux * dt + ex * drift), py + (uy * dt + ey * drift), pz + (uz * dt + ez * drift))
    return position, (ux + ex * decay, uy + ey * decay, uz + ez * decay)


def lead(ahead: Vector, rate_ahead: Vector, lag: float) -> Vector:
    """Return x(t + D) + lag x'(t + D) of a reference x, given as `ahead` and `rate_ahead` at t + D; `lag` in s.

        lag v' + v = u(t − D)   and   v = r'   give   u_r(t) = r'(t + D) + lag r''(t + D)
        y_r = r(t + D) + lag r'(t + D)        (ours)

    Of r' (m/s) it is the command that gives the airframe the reference's velocity when it takes effect; of r (m) the
    stopping point of an airframe that follows the reference. With y that of the airframe, e_y = y − y_r and
    u = u_r − K e_y, the error obeys e_y' = −K e_y: lag and dead time are out of the loop.
    """
    return (ahead[0] + lag * rate_ahead[0], ahead[1] + lag * rate_ahead[1], ahead[2] + lag * rate_ahead[2])


def critical_gain(lag: float, dead_time: float) -> float:
    """Return the gain k in 1/s at which the position loop of a lagging airframe oscillates without decay.

        x' = v,   lag v' + v = −k x(t − D)
        atan(w lag) + w D = pi/2,   k = w sqrt(1 + (w lag)^2)        (ours: the loop's phase margin is zero)

    `lag` and `dead_time` D >= 0 in s; D counts every delay of the loop, half a control period included. Without
    dead time the loop is of second order, hence stable at every gain: inf.
    """
    if dead_time <= 0.0:
        return inf
    w, phase_left = 0.0, pi / 2
    while phase_left > 1e-12:
        # The phase is concave in w, so Newton's iteration climbs to the root without overshoot.
        w += phase_left / (dead_time + lag / (1.0 + (w * lag) ** 2))
        phase_left = pi / 2 - atan(w * lag) - w * dead_time
    return w * sqrt(1.0 + (w * lag) ** 2)


def smallest_smoothing(formation_gain: float, compensation_gain: float, lag: float, dead_time: float) -> float | None:
    """Return the smallest epsilon in m at which the loop of (9) does not oscillate, None if there is none.

        K + phi / epsilon <= critical_gain / 2        (a gain margin of 2)

    The left side is the slope of (9) at zero error. `formation_gain` is K in 1/s, `compensation_gain` phi in m/s, `lag`
    and `dead_time` in s as for `critical_gain`. None means that K alone is too high; 0.0 that every epsilon > 0 is
    enough.
    """
    room = critical_gain(lag, dead_time) / 2.0 - formation_gain
    return compensation_gain / room if room > 0.0 else None
