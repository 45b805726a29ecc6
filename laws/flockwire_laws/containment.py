"""Containment by several leaders: `law = "containment"` is 8c, with an observer.

M. Ji, G. Ferrari-Trecate, M. Egerstedt, A. Buffa, "Containment control in mobile networks", IEEE Trans. Automatic
Control 53(8), 2008: 8a. Y. Cao, W. Ren, M. Egerstedt, "Distributed containment control with multiple stationary or
dynamic leaders in fixed and switching directed networks", Automatica 48(8), 2012: 8b. Y. Cao, W. Ren, Z. Meng, Systems
& Control Letters 59(9), 2010: 8c's estimator. With delta_i = sum_j w_ij (p_i − p_j), leaders among the j:

    8a AtRest       u_i = −k delta_i, leaders at rest
    8b Sliding      u_i = −k delta_i − beta sgn(delta_i), per axis; |v_leader| <= gamma < beta
    8c Containment  u_i = y_i − k delta_i,  y_i' = −beta sgn(sum_j w_ij (y_i − y_j)),  y_j = v_j of a leader

p position (m), u, y velocity (m/s), k 1/s, beta m/s in 8b, m/s^2 in 8c (|a_leader| <= gamma < beta). To every follower
leads a path from a leader. p_f -> −L_ff^-1 L_fl p_l, inside the hull; 8a at the rate k min Re lambda(L_ff), 8b and y of
8c after |e(0)|/(beta − gamma) at most. y makes a backward Euler step, and 8b's sgn is that of one: no chatter of y.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Array, Velocity, flown_velocity, size, vector, weighted


class Gains(fw.Parameters):
    """The gains k and beta."""

    gain: fw.Positive = 1.0  # 1/s
    beta: fw.Positive = 0.5  # m/s in 8b, m/s^2 in 8c


class AtRest:
    """The law 8a for one follower."""

    information = fw.Information(neighbours=fw.Sense.POSITION, leaders=(2, 64))
    Parameters = Gains
    check = classmethod(checks.containment)

    def __init__(self, settings: fw.LawSettings) -> None:
        self.gains = Gains.of(settings.parameters)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; the error is |delta_i| / sum_j w_ij."""
        if observation.place is None or not observation.neighbours:
            return fw.Decision()
        pull, total = weighted(observation.neighbours, lambda one: one.position)
        ahead, message = self.ahead(observation, -pull, total)
        return fw.Decision(ahead + self.gains.gain * pull, message, size(pull) / total)

    def ahead(self, observation: fw.Observation, delta: Array, total: float) -> tuple[Array, Velocity | None]:
        """Return what is added to −k delta_i, m/s, and what is sent."""
        return np.zeros(3), None


class Sliding(AtRest):
    """The law 8b for one follower."""

    def ahead(self, observation: fw.Observation, delta: Array, total: float) -> tuple[Array, Velocity | None]:
        """Return −beta sgn(delta_i), its size cut off where one step of it would cross 0."""
        return -np.clip(delta / (total * max(observation.dt, 1e-9)), -self.gains.beta, self.gains.beta), None


class Containment(AtRest):
    """The law 8c for one follower."""

    information = fw.Information(neighbours=fw.Sense.POSITION, message=Velocity, leaders=(2, 64))
    lead = staticmethod(flown_velocity)

    def __init__(self, settings: fw.LawSettings) -> None:
        super().__init__(settings)
        self._y = np.zeros(3)

    def ahead(self, observation: fw.Observation, delta: Array, total: float) -> tuple[Array, Velocity | None]:
        """Return y_i, and send the next: a = sum_j w_ij y_j / sum_j w_ij,  a + sgn(y − a) max(|y − a| − beta dt, 0)."""
        now, (pull, heard) = self._y, weighted(observation.heard, lambda one: one.content.velocity)
        if heard:
            mean, error = pull / heard, now - pull / heard
            self._y = mean + np.sign(error) * np.maximum(np.abs(error) - self.gains.beta * observation.dt, 0.0)
        return now, Velocity(vector(self._y))
