"""Small-signal stability of (9) with an airframe's first-order lag and dead time."""

from math import atan, inf, pi, sqrt


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


def smallest_smoothing(
    formation_gain: float, compensation_gain: float, lag: float, dead_time: float, margin: float = 2.0
) -> float | None:
    """Return the smallest epsilon in m at which the loop of (9) does not oscillate, None if there is none.

        K + phi / epsilon <= critical_gain / margin

    The left side is the slope of (9) at zero error. `formation_gain` is K in 1/s, `compensation_gain` phi in m/s, `lag`
    and `dead_time` in s as for `critical_gain`, `margin` >= 1 the gain margin. None means that K alone is too high; 0.0
    that every epsilon > 0 is enough.
    """
    room = critical_gain(lag, dead_time) / margin - formation_gain
    return compensation_gain / room if room > 0.0 else None
