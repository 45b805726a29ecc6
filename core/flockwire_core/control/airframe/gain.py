"""How strongly an airframe obeys: the gain of its horizontal velocity, learned in flight, though wind blows.

    lag v' + v = g u(t − D) + w,   x' = v
    X = F (x + lag v)',   U = F u(t − D),   F(s) = tau s / (1 + tau s)^2
    low = (∫ X·U + P) / (∫ U·U + P),   high = (∫ X·X + P) / (∫ X·U + P),   while |V| > max(0.03 m/s, 0.3 |U|)
    g is the value in [low, high] nearest to 1; its certainty (low/high)^2 c^2 / (1 + c^2), c = ∫ U·U / P       (ours)

The command u opposes the wind, so ∫ U·W <= 0, W = F w: the least squares of X on U, `low`, take wind for a gain that
is too small, and those of U on X, `high`, for one that is too large (Frisch's bounds of errors in variables). What both
agree on is a gain. F leaves out slow changes, which gusts have most of; without motion the gain stays 1.
"""

from __future__ import annotations

from collections import deque
from math import exp

from flockwire_core.domain.vector import ZERO, Vector

PRIOR = 0.003  # m^2/s, P: as much as a start to 0.2 m/s
MOVING, WANTED = 0.03, 0.3  # m/s of |V|, and its least share of |U|
MEMORY = 5.0  # m^2/s of ∫ U·U that are remembered, so that a gain that changes is followed
SETTLED = 2.0  # s of free flight before the gain is learned: F forgets what was before
LONGEST_GAP = 1.0  # s without a position
LOWEST, HIGHEST = 0.6, 1.6

Level = tuple[float, float]  # the horizontal part of a vector


class AirframeGain:
    """The horizontal gain of one airframe with `lag` and `dead_time`, s.

    `value` is g, at first 1, `certainty` from 0 to 1.
    """

    def __init__(self, lag: float, dead_time: float) -> None:
        self._lag, self._dead_time = lag, dead_time
        self.reset()

    def reset(self) -> None:
        """Forget the gain: the airframe does not fly."""
        self.value, self.certainty = 1.0, 0.0
        self._uu = self._xu = self._xx = 0.0  # m^2/s, the integrals
        self.restart()

    def restart(self) -> None:
        """Leave out the motion until now, in which the airframe was not free, or was not seen."""
        self._coming: deque[tuple[float, Vector, Vector]] = deque()  # time of effect (s), u and v_c (m/s)
        self._in_effect = ZERO, ZERO
        self._last: tuple[float, Level] | None = None  # the stamp (s) and x + lag v (m)
        self._waits = SETTLED  # s
        self._passes = BandPass(), BandPass(), BandPass()  # of X, U and V

    def command(self, given: Vector, wanted: Vector, now: float) -> None:
        """Record the command u and the wanted velocity v_c, m/s, of `now` (s)."""
        coming = self._coming
        if coming and coming[0][0] < now - LONGEST_GAP:
            self.restart()
        self._coming.append((now + self._dead_time, given, wanted))

    def measure(self, position: Vector, velocity: Vector, stamp: float) -> None:
        """Receive position, m, and velocity, m/s, at `stamp` (s); update the gain."""
        there = (position[0] + self._lag * velocity[0], position[1] + self._lag * velocity[1])
        last, self._last = self._last, (stamp, there)
        if last is None or not 0.0 < stamp - last[0] <= LONGEST_GAP:
            self._effect(stamp, stamp)
            return
        dt, (x, y) = stamp - last[0], last[1]
        given, wanted = self._effect(last[0], stamp)
        share, (of_x, of_u, of_v) = 1.0 - exp(-dt / 0.35), self._passes  # s, tau
        mx, my = of_x.update((there[0] - x) / dt, (there[1] - y) / dt, share)
        ux, uy = of_u.update(given[0] / dt, given[1] / dt, share)
        vx, vy = of_v.update(wanted[0] / dt, wanted[1] / dt, share)
        self._waits -= dt
        given_square = ux * ux + uy * uy
        if self._waits < 0.0 and vx * vx + vy * vy > max(MOVING * MOVING, WANTED * WANTED * given_square):
            self._weigh(dt * given_square, dt * (mx * ux + my * uy), dt * (mx * mx + my * my))

    def _weigh(self, uu: float, xu: float, xx: float) -> None:
        """Add to the integrals, m^2/s."""
        uu, xu, xx = self._uu + uu, self._xu + xu, self._xx + xx
        if uu > MEMORY:
            kept = MEMORY / uu
            uu, xu, xx = kept * uu, kept * xu, kept * xx
        self._uu, self._xu, self._xx = uu, xu, xx
        self.value, self.certainty = 1.0, 0.0
        if xu > 0.0:
            low, high = (xu + PRIOR) / (uu + PRIOR), (xx + PRIOR) / (xu + PRIOR)
            self.value = min(max(low, min(1.0, high), LOWEST), HIGHEST)
            self.certainty = min(low / high, 1.0) ** 2 * uu * uu / (uu * uu + PRIOR * PRIOR)

    def _effect(self, begin: float, end: float) -> tuple[Level, Level]:
        """Return the integrals of u and v_c in effect from `begin` to `end` (s), m."""
        ux = uy = vx = vy = 0.0
        coming, (u, v), at = self._coming, self._in_effect, begin
        while coming and coming[0][0] <= end:
            effective, next_u, next_v = coming.popleft()
            if effective > at:
                dt, at = effective - at, effective
                ux, uy, vx, vy = ux + dt * u[0], uy + dt * u[1], vx + dt * v[0], vy + dt * v[1]
            u, v = next_u, next_v
        self._in_effect, dt = (u, v), end - at
        return (ux + dt * u[0], uy + dt * u[1]), (vx + dt * v[0], vy + dt * v[1])


class BandPass:
    """F(s) = tau s / (1 + tau s)^2 of a horizontal velocity: a low-pass, less its own low-pass."""

    def __init__(self) -> None:
        self._mean = self._slow = (0.0, 0.0)

    def update(self, x: float, y: float, share: float) -> Level:
        """Return the filtered velocity (`x`, `y`), m/s; `share` is 1 − e^(−dt/tau)."""
        (mx, my), (sx, sy) = self._mean, self._slow
        mx, my = mx + share * (x - mx), my + share * (y - my)
        sx, sy = sx + share * (mx - sx), sy + share * (my - sy)
        self._mean, self._slow = (mx, my), (sx, sy)
        return mx - sx, my - sy
