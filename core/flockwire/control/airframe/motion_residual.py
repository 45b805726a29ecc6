"""Whether a drone's tracked body moves as it is commanded.

The stopping point y of an airframe obeys y' = u (state.py). A tracker that moves the body away at a velocity d
makes its pilot command −d, so the body stays and the residual is d. No other sensor on board knows the position.

    E <- LP(y' − u),   U <- LP(u),   LP: first order, T = 3 s        (ours)
    the body is not the drone's if |E| > drift + 0.2 |U| + 0.05 |u − U| for 0.5 s

The drift is that of an airframe that hovers by its own sensors (a good one: 0.1 m/s), and that of the wind. The other
terms allow for a gain that is wrong by 20 %, and for a lag that is wrong by 0.15 s.
"""

from __future__ import annotations

from math import dist, exp, hypot

from flockwire.domain.vector import ZERO, Vector

TIME_CONSTANT = 3.0  # s
GAIN_ERROR = 0.2
LAG_ERROR = 0.15 / TIME_CONSTANT
LASTING = 0.5  # s


class MotionResidual:
    """The residual of one drone.

    `drift`: m/s, of the airframe; `fastest`: the largest |y' − u|, m/s, that is motion and not a jump.
    """

    def __init__(self, drift: float, fastest: float) -> None:
        self.speed = 0.0  # m/s, |E|
        self._drift, self._fastest = drift, fastest
        self.reset()

    def reset(self) -> None:
        """Forget: the drone does not fly freely, or its position is not known."""
        self.speed, self._error, self._usual = 0.0, ZERO, ZERO
        self._last: tuple[float, Vector, Vector] | None = None
        self._since: float | None = None

    def update(self, stopping: Vector, travelled: Vector, now: float) -> bool:
        """Return whether the body moves apart from its commands.

        `stopping` is y and `travelled` the integral of u, both m, at `now` (s).
        """
        last, self._last = self._last, (now, stopping, travelled)
        if last is None or now <= last[0]:
            return False
        dt, q = now - last[0], exp((last[0] - now) / TIME_CONSTANT)
        command, motion = _rate(last[2], travelled, dt), _rate(last[1], stopping, dt)
        if dist(motion, command) > self._fastest:  # the gateway judges jumps
            return False
        self._error = _mean(self._error, (motion[0] - command[0], motion[1] - command[1], motion[2] - command[2]), q)
        self._usual = _mean(self._usual, command, q)
        self.speed = hypot(*self._error)
        limit = self._drift + GAIN_ERROR * hypot(*self._usual) + LAG_ERROR * dist(command, self._usual)
        if self.speed <= limit:
            self._since = None
            return False
        self._since = now if self._since is None else self._since
        return now - self._since >= LASTING


def _rate(before: Vector, after: Vector, dt: float) -> Vector:
    return ((after[0] - before[0]) / dt, (after[1] - before[1]) / dt, (after[2] - before[2]) / dt)


def _mean(mean: Vector, value: Vector, q: float) -> Vector:
    """Return the low-passed `mean` after a step with the factor `q`."""
    p = 1.0 - q
    return (q * mean[0] + p * value[0], q * mean[1] + p * value[1], q * mean[2] + p * value[2])
