"""Formation tracking by a sliding mode observer of the leader: `law = "sliding_mode"`.

Y. Cao, W. Ren, Z. Meng, "Decentralized finite-time sliding mode estimators and their applications in decentralized
finite-time formation tracking", Systems & Control Letters 59(9), 2010:

    eta_i' = −beta sgn(sum_{j in N_i} w_ij (eta_i − eta_j)), per axis,   eta_0 = x_0 of the leader
    u_i = h_i' + eta_i' − k (p_i − h_i − eta_i)

p position, h place, eta the estimate of the leader's position, which it sends (m), beta m/s, k 1/s, u m/s. For beta
above the leader's speed per axis eta_i = x_0 after |e(0)|/(beta − |v_0|) at most, |e(0)| the largest first error of an
axis, if a path leads from the leader to each follower; the observer (8) of the paper's law has a term more, that bounds
this time for any first error. p_i − h_i − eta_i falls at the rate k, whatever eta_i does. sgn makes a backward Euler
step, without chatter: a = sum_j w_ij eta_j / sum_j w_ij,  eta <- a + sgn(eta − a) max(|eta − a| − beta dt, 0).
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Array, size, vector, weighted


class Gains(fw.Parameters):
    """The gains beta and k."""

    beta: fw.Positive = 3.0  # m/s
    gain: fw.Positive = 3.0  # 1/s


class SlidingMode:
    """The law for one follower; its first estimate is its own position."""

    information = fw.RELAYING
    Parameters = Gains
    check = classmethod(checks.relayed)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gains = Gains.of(settings.parameters)
        self._eta: Array | None = None

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i and eta_i; the error is |p_i − h_i − eta_i|."""
        before, dt = self._eta, max(observation.dt, 1e-9)
        if before is None:
            if observation.position is None:
                return fw.Decision()
            before = np.array(observation.position)
        total, weight = weighted(observation.heard, lambda one: one.content.position)
        eta = before
        if weight:
            mean = total / weight
            away, most = before - mean, self._gains.beta * dt
            eta = mean + np.sign(away) * np.maximum(np.abs(away) - most, 0.0)
        self._eta, message = eta, fw.LeaderMotion(vector(eta))
        place, t = observation.place, observation.t
        if place is None or observation.position is None:
            return fw.Decision(message=message)
        error = np.subtract(observation.position, place.offset(t)) - eta
        ahead = np.clip((eta - before) / dt, -self._gains.beta, self._gains.beta)
        return fw.Decision(place.rate(t) + ahead - self._gains.gain * error, message, size(error))
