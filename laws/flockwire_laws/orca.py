"""Optimal reciprocal collision avoidance on the way to the places behind a leader: `law = "orca"`.

J. van den Berg, S. J. Guy, M. Lin, D. Manocha, "Reciprocal n-body collision avoidance", Robotics Research (ISRR 2009),
Springer Tracts in Advanced Robotics 70, 2011. Of each body, p relative position, r the distance to be kept, both m,

    VO = {v : exists t in (0, tau], |t v − p| < r},   w the smallest change of the relative velocity that leaves VO
    u_i = the v nearest to v*_i with n'v >= n'v_i + n'w/2 of every drone, n'v >= n'v_i + n'w of any other body
    v*_i = h_i' + v_0 − K (p_i − h_i − x_0),   the last term of at most the drone's speed

n is the outward normal of VO at w, tau a horizon (s), K 1/s, u m/s. A drone takes half of w, as the other one takes
the other half. x_0 is the mean of what the neighbours relay of the leader. Where nothing is near, errors fall at the
rate K. No theorem of arrival: symmetric crossings may lock.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw
from flockwire_core.control.safety_filter import nearest_velocity

from flockwire_laws import checks
from flockwire_laws.relative import size, vector, weighted
from flockwire_laws.velocity_obstacle import half_plane


class Gains(fw.Parameters):
    """K; tau; what is added to the distances that the safety filter keeps."""

    gain: fw.Positive = 3.0  # 1/s
    horizon: fw.Positive = 2.0  # s
    spare: fw.NotNegative = 0.02  # m


class Orca:
    """The law for one follower."""

    information = fw.RELAYING
    Parameters = Gains
    check = classmethod(checks.relayed)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gains, self._settings = Gains.of(settings.parameters), settings
        self._leader: fw.LeaderMotion | None = None

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i, and x_0 and v_0 as it knows them; the error is |p_i − h_i − x_0|."""
        self._observe(observation)
        leader, place, t = self._leader, observation.place, observation.t
        if leader is None or place is None or observation.position is None or observation.velocity is None:
            return fw.Decision(message=leader)
        error = np.subtract(observation.position, place.offset(t)) - leader.position
        speed, back = self._settings.speed, -self._gains.gain * error
        back *= min(1.0, speed / max(size(back), 1e-9))
        kept, tau, planes = self._settings.guard.separation, self._gains.horizon, []
        for body in observation.bodies:
            share = 0.5 if body.kind is fw.BodyKind.DRONE else 1.0
            radius = kept.from_axis(body) + self._gains.spare
            planes.append(half_plane(observation.velocity, body, radius, share, tau))
        wanted = vector(np.add(place.rate(t), leader.velocity) + back)
        return fw.Decision(nearest_velocity(wanted, planes, speed)[0], leader, size(error))

    def _observe(self, observation: fw.Observation) -> None:
        """Average what the neighbours relay, each moved on to now; keep the last one without any."""
        now, heard = observation.now, observation.heard
        position, total = weighted(heard, lambda one: one.content.after((now - one.stamp) / fw.SECOND).position)
        if total:
            velocity = weighted(heard, lambda one: one.content.velocity)[0] / total
            self._leader = fw.LeaderMotion(vector(position / total), vector(velocity))
