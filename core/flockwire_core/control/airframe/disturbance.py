"""An airframe that wind, or a wrong gain, moves beside its commands: both are estimated and compensated.

    lag v' + v = g u(t − D) + w,   x' = v

Law and safety filter choose the velocity v_c that is to be flown. The command is u = (v_c − d) / g with the estimates d
of w and g of the horizontal gain (gain.py). With u~ = v_c − d the airframe is followed (state.py) in
a frame that drifts as the estimate says. There it obeys its model with the rest w − d as its only disturbance, so the
estimate does not wait for the command's way through the airframe:

    lag s' + s = d,   S' = s,   x~ = x − S,   v~ = v − s   =>   lag v~' + v~ = u~(t − D) + (w − d)
    r = (x~ + lag v~ − ∫ u~(t − D))' = w − d
    d' = 2 r / T + p,   p' = r / T^2,   |d| <= most        (ours)
    y = x + lag v + ∫_{t−D}^{now} (u~ + d)   =>   y' = v_c + (w − d) + O(d')

So (T d/dt + 1)^2 (w − d) = T^2 w'': d follows a wind that is constant or changes evenly without error. While d = w, the
stopping point y obeys y' = v_c as without wind: law and filter see no difference. T is shorter the better the gain is
known: a gain that is wrong costs the loop through d margin. g follows the learned gain in T_g = 1 s: applied at once,
a change would move the command, in wind like a sudden gust, until d has adapted.
"""

from __future__ import annotations

from math import copysign, exp

from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.control.airframe.gain import AirframeGain
from flockwire_core.control.airframe.state import LEVEL, WHOLE, AirframeState
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, scale, subtract

UNCERTAIN, CERTAIN = 0.5, 0.22  # s, T while the gain is not known, and when it is (docs/theory.md)


class DisturbedAirframe(AirframeState):
    """An AirframeState with the estimates of the disturbance, at most `most` > 0 m/s, at first none, and of the gain.

    It flies no command above `fastest`, m/s. A position that jumps faster than twice as much changes no estimate.
    """

    def __init__(self, lag: float, dead_time: float, most: float, fastest: float) -> None:
        super().__init__(lag, dead_time, 0.07)  # s, of the airframe's velocity: a slower one costs the loop its margin
        self._most, self._fastest = most, fastest  # the base's `disturbance` is d, its `last_command` v_c
        self.gain = 1.0  # the horizontal gain that commands are given for, g
        self._gain = AirframeGain(lag, dead_time)
        self._slope: Vector = ZERO  # m/s^2, p
        self._drift, self._drifted = ZERO, ZERO  # m/s and m, s and S at the stamp
        self._rest: Vector | None = None  # m, x~ + lag v~ − ∫ u(t − D) at the stamp; None: not known or not free

    def reset(self) -> None:
        """Forget the estimate: the airframe does not fly."""
        self.disturbance = self._slope = self._drift = ZERO
        self._rest = None
        self.gain = 1.0
        self._gain.reset()

    def limit_vertical(self, most: float) -> None:
        """Limit the vertical part of the estimate to `most`, m/s."""
        x, y, z = self.disturbance
        if abs(z) > most:
            self.disturbance, self._slope = (x, y, copysign(most, z)), _by_axis(self._slope, LEVEL)

    def command(self, velocity: Vector, now: float) -> Vector:
        """Return the command that makes the airframe fly `velocity`, m/s, from `now` (s) on, and record it."""
        through, gain = subtract(velocity, self.disturbance), self.gain
        given = (through[0] / gain, through[1] / gain, through[2])
        if norm(given) > self._fastest:
            given = limit(given, self._fastest)
            through = (given[0] * gain, given[1] * gain, given[2])
        super().command(through, now)
        self.last_command = velocity
        self._gain.command(given, velocity, now)
        return given

    def measure(self, position: Vector, stamp: float, now: float, learns: Vector | None = WHOLE) -> Motion:
        """Receive a position as AirframeState does; return the motion at `now`, before the next command.

        `learns` is 1 for each axis whose estimate changes, 0 for one that is kept; None: all are.
        """
        dt = stamp - self._stamp
        if dt > 0.0:
            moved, self._drift = lagged_motion(ZERO, self._drift, self.disturbance, self._lag, dt)
            self._drifted = add(self._drifted, moved)
        motion = super().measure(subtract(position, self._drifted), stamp, now)
        if dt != 0.0:
            self._learn(subtract(motion.stopping, self.travelled(now)), dt, learns)
        velocity = add(motion.velocity, self._drift)
        if learns is None or not learns[0]:
            self._gain.restart()
        elif dt > 0.0:
            self._gain.measure(position, velocity, stamp)
            self.gain += (1.0 - exp(-dt / 1.0)) * (self._gain.value - self.gain)  # s, T_g
        waits = now - stamp + self._dead_time
        ahead = add(scale(self._drift, self._lag), scale(self.disturbance, waits))
        return Motion(position, velocity, add(add(motion.stopping, self._drifted), ahead))

    def speed(self, most: float) -> float:
        """Return the speed, m/s, of v_c that keeps every command within `most`."""
        return max(0.0, min(1.0, self.gain) * most - norm(self.disturbance))

    def _learn(self, rest: Vector, dt: float, learns: Vector | None) -> None:
        """Update the estimate by the change of `rest`, m, in `dt` s."""
        last, self._rest = self._rest, rest if learns is not None else None
        if last is None or learns is None or dt <= 0.0:
            self._slope = ZERO
            return
        x, y, z = change = subtract(rest, last)
        if x * x + y * y + z * z > (2.0 * self._fastest * dt) ** 2:  # times the highest speed: faster is no motion
            self._gain.restart()
            return
        moved, slope = _by_axis(change, learns), _by_axis(self._slope, learns)
        level = 1.0 / (UNCERTAIN + self._gain.certainty * (CERTAIN - UNCERTAIN))
        rates = (level, level, 1.0 / UNCERTAIN)  # 1/T by axis: the vertical gain is never known
        found = add(self.disturbance, add(_by_axis(moved, scale(rates, 2.0)), scale(slope, dt)))
        self.disturbance = limited = limit(found, self._most)
        # By value: compiled tuples have no identity.
        self._slope = add(slope, _by_axis(_by_axis(moved, rates), rates)) if limited == found else ZERO


def _by_axis(v: Vector, factors: Vector) -> Vector:
    """Return `v`, each component times its own factor."""
    return (v[0] * factors[0], v[1] * factors[1], v[2] * factors[2])
