"""Consensus by events: `law = "event_triggered"` is 10b.

D. V. Dimarogonas, E. Frazzoli, K. H. Johansson, "Distributed event-triggered control for multi-agent systems", IEEE
Trans. Automatic Control 57(5), 2012: 10a. G. S. Seyboth, D. V. Dimarogonas, K. H. Johansson, "Event-based broadcasting
for multi-agent average consensus", Automatica 49(1), 2013: 10b. With q_i = p_i − h_i, x_i the last q_i sent:

    u_i = h_i' − sum_j w_ij (x_i − x_j)
    10a StateTriggered  sends when |x_i − q_i|^2 > sigma a (1 − a n_i)/n_i |sum_j w_ij (q_i − q_j)|^2,  n_i = sum_j w_ij
    10b EventTriggered  sends when |x_i − q_i| > c0 + c1 exp(−alpha t)

p, h, q, x, c0, c1 in m, u in m/s, w and alpha in 1/s, t (s) since the order. Undirected, connected. The average of q is
kept exactly; 10b: |q − average| <= |L| sqrt(N) c0 / lambda_2 at last, 0 < alpha < lambda_2, no Zeno. 10a also sees its
neighbours all the time; 0 < sigma < 1, 0 < a < 1/n_i (here a = 1/(2 n_i), which is best).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Array, apart, size, vector, weighted


class Sent(NamedTuple):
    """x_i, m."""

    x: tuple[float, float, float]


class Thresholds(fw.Parameters):
    """As in the equations."""

    c0: fw.NotNegative = 0.01  # m
    c1: fw.NotNegative = 0.3  # m
    alpha: fw.Positive = 0.3  # 1/s
    sigma: fw.Positive = 0.65


class EventTriggered:
    """The law 10b for one drone."""

    information = fw.Information(own=fw.Sense.POSITION, message=Sent, pace=fw.Pace.EVENT, directed=False)
    Parameters = Thresholds
    check = classmethod(checks.event_triggered)

    def __init__(self, settings: fw.LawSettings) -> None:
        self.thresholds = Thresholds.of(settings.parameters)
        self._x: Array | None = None

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i, and x_i at an event; the error is |sum_j w_ij (x_i − x_j)| / sum_j w_ij."""
        place, t = observation.place, observation.t
        if place is None or observation.position is None:
            self._x = None
            return fw.Decision()
        q = np.array(observation.position) - place.offset(t)
        x = q if self._x is None else self._x  # what others know in this step: so each pair cancels
        event = self._x is None or size(x - q) > self.threshold(observation, place)
        self._x = q if event else x
        pull, total = weighted(observation.heard, lambda one: one.content.x - x)
        message, error = Sent(vector(q)) if event else None, size(pull) / total if total else None
        return fw.Decision(place.rate(t) + pull, message, error)

    def threshold(self, observation: fw.Observation, place: fw.Place) -> float:
        """Return the |x_i − q_i|, m, above which it sends."""
        return self.thresholds.c0 + self.thresholds.c1 * float(np.exp(-self.thresholds.alpha * observation.t))


class StateTriggered(EventTriggered):
    """The law 10a for one drone."""

    information = EventTriggered.information._replace(neighbours=fw.Sense.POSITION)

    def threshold(self, observation: fw.Observation, place: fw.Place) -> float:
        """Return sqrt(sigma) |sum_j w_ij (q_i − q_j)| / (2 n_i): that of a = 1/(2 n_i)."""
        pull, total = weighted(observation.neighbours, lambda one: apart(place, one, observation.t))
        return float(self.thresholds.sigma**0.5) * size(pull) / (2.0 * total) if total else 0.0
