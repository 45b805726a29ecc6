"""Optimised flocking in an arena: `law = "vasarhelyi"`.

G. Vasarhelyi, C. Viragh, G. Somorjai, T. Nepusz, A. E. Eiben, T. Vicsek, "Optimized flocking of autonomous drones in
confined environments", Science Robotics 3(20), 2018:

    u_i = v_flock v_i/|v_i| + rep + frict + walls, its length cut off at v_max
    rep = sum_{r_ij < r_rep} p_rep (r_rep − r_ij) (r_i − r_j)/r_ij
    frict = sum_{v_ij > V} C (v_ij − V) (v_j − v_i)/v_ij,   V = max(v_frict, D(r_ij − r_frict, a_frict, p_frict))
    wall = (v_is − V_s) (v_s − v_i)/v_is if v_is = |v_i − v_s| > V_s = D(r_is − r_shill, a_shill, p_shill)
    D(r, a, p) = 0 (r <= 0); r p (r p < a/p); sqrt(2 a r − a^2/p^2)

r position (m), v velocity, u its command (m/s). A shill at the nearest point of each wall, and of each obstacle, flies
away from it at v_shill. The constants are the source's for 4 m/s; `length` and `speed` scale them (times by
length / speed). v_i/|v_i| is a given heading until |v_i| first exceeds 0.05 v_flock. No theorem: order parameters
(velocity correlation 0.92, speed 3.83 m/s of 4). The airframe's lag belongs to the law: friction adds to a command.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.arena import Point, braking, walls
from flockwire_laws.relative import size


class Constants(fw.Parameters):
    """Scales, and the arena from its low to its high corner, m; the rest as in the equation at scale 1."""

    length: fw.Positive = 0.05
    speed: fw.Positive = 0.15
    arena: tuple[Point, Point] | None = None
    v_flock: fw.Positive = 4.0
    v_max: fw.Positive = 6.0
    rep: tuple[float, float] = (25.6, 0.13)  # r m, p 1/s
    frict: tuple[float, float, float, float, float] = (85.3, 0.05, 0.63, 3.2, 4.16)  # r m, C, v m/s, p 1/s, a m/s^2
    shill: tuple[float, float, float, float] = (0.3, 13.6, 3.55, 5.3)  # r m, v m/s, p 1/s, a m/s^2


class Vasarhelyi:
    """The law for one drone; `radius` is r_frict at `length` 0.05 and more."""

    information = fw.Information(around=fw.STATE, radius=8.0, own=fw.STATE, planar=True)
    Parameters = Constants
    check = classmethod(checks.vasarhelyi)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._constants = Constants.of(settings.parameters)
        self._heading = np.array([np.cos(2.4 * settings.number), np.sin(2.4 * settings.number), 0.0])
        self._moved = False

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i."""
        c = self._constants
        if observation.place is None or observation.position is None or observation.velocity is None:
            self._moved = False
            return fw.Decision()
        s, q = c.length, c.speed
        own = np.array(observation.velocity) * (1.0, 1.0, 0.0)
        self._moved = self._moved or size(own) > 0.05 * q * c.v_flock
        if self._moved and size(own):
            self._heading = own / size(own)
        command = q * c.v_flock * self._heading
        (r_rep, p_rep), (r_frict, gain, v_frict, p_frict, a_frict) = c.rep, c.frict
        for one in observation.around:
            line, change = np.array(one.position), np.array(one.velocity)
            distance, v = size(line), size(change)
            if 0.0 < distance < s * r_rep:
                command -= q / s * p_rep * (s * r_rep - distance) * line / distance
            allowed = max(q * v_frict, braking(distance - s * r_frict, q * q / s * a_frict, q / s * p_frict))
            if v > allowed:
                command += gain * (v - allowed) * change / v
        r, speed, p, a = c.shill
        for distance, normal in walls(c.arena, observation):
            change = q * speed * normal - own
            allowed, v = braking(distance - s * r, q * q / s * a, q / s * p), size(change)
            if v > allowed:
                command += (v - allowed) * change / v
        return fw.Decision(command * min(1.0, q * c.v_max / max(size(command), 1e-9)))
