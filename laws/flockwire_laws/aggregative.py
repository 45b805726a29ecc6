"""Aggregative tracking, in rounds: `law = "aggregative"`.

X. Li, L. Xie, Y. Hong, "Distributed aggregative optimization over multi-agent networks", IEEE Trans. Automatic Control
67(6), 2022; G. Carnevale, A. Camisa, G. Notarstefano, "Distributed online aggregative optimization for dynamic
multirobot coordination", 68(6), 2023. Minimise sum_i f_i(x_i, sigma), sigma the mean of all x_i, here (phi(x) = x)

    f_i = g1/2 |x − r_i|^2 + g2/2 |sigma − b|^2 + g3/2 |x − sigma|^2
    x+ = x − alpha (grad_1 f(x, s) + y)
    s+ = sum_j a_ij s_j + x+ − x,                                   s(0) = x(0)
    y+ = sum_j a_ij y_j + grad_2 f(x+, s+) − grad_2 f(x, s),        y(0) = grad_2 f(x(0), s(0))

x, s, r_i (the place h_i), b in m, g and y without unit and in m, alpha a step. A is doubly stochastic: the weights of
the edges are a_ij (Metropolis: 1/(1 + the larger degree)), a_ii = 1 − their sum. Round k + 1 waits for round k of all
neighbours; mean s = mean x and mean y = mean grad_2 f in each. The drone follows, u = (x − p)/T (m/s), T the period s.
A drone that began its rounds again stops those of its neighbours: no round of both fits.

mean x* = (g1 mean r + g2 b)/(g1 + g2),  x_i* = (g1 r_i + g3 mean x* − g2 (mean x* − b))/(g1 + g3).
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.aggregative_task import Task, Tracker, Triple
from flockwire_laws.relative import size, vector, weighted

RESTARTED = "drone {} began its rounds again, and no round fits: order the formation again"


class Aggregative:
    """The law for one drone."""

    information = fw.Information(
        own=fw.Sense.POSITION, message=Tracker, pace=fw.Pace.ROUND, directed=False, planar=True
    )
    Parameters = Task
    check = classmethod(checks.aggregative)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._task, self._start, self._round = Task.of(settings.parameters), -1, 0
        self._heard: dict[tuple[int, int], dict[int, fw.Heard]] = {}
        self._x = self._s = self._y = np.zeros(3)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i, and s_i and y_i of a round that begins; the error is |x − p| in the plane."""
        for one in observation.news:
            if one.content.start == self._start and one.content.round < self._round - 1:
                raise RuntimeError(RESTARTED.format(one.number))
            self._heard.setdefault((one.content.start, one.content.round), {})[one.number] = one
        place, t = observation.place, observation.t
        if place is None or observation.position is None:
            return fw.Decision()
        own, begins = np.array(observation.position), place.start != self._start
        heard = self._heard.get((place.start, self._round), {})
        if begins:
            self._start, self._round, self._x, self._s = place.start, 0, own, own
            self._y = self._task.gradients(own, own, place.offset(t))[1]
        elif t >= (self._round + 1) * self._task.period and heard.keys() >= place.ranks.keys():
            self._advance(list(heard.values()), place.offset(t))
            self._heard = {
                key: kept for key, kept in self._heard.items() if key[0] > place.start or key[1] >= self._round
            }
            begins = True
        message = Tracker(self._start, self._round, vector(self._s), vector(self._y)) if begins else None
        return fw.Decision((self._x - own) / self._task.period, message, size((self._x - own)[:2]))

    def _advance(self, heard: list[fw.Heard], r: Triple) -> None:
        """Make one round with what the neighbours sent of it."""
        first, second = self._task.gradients(self._x, self._s, r)
        rest = 1.0 - sum(one.weight for one in heard)
        s = rest * self._s + weighted(heard, lambda one: one.content.s)[0]
        y = rest * self._y + weighted(heard, lambda one: one.content.y)[0]
        x = self._x - self._task.alpha * (first + self._y)
        self._s = s + x - self._x
        self._y = y + self._task.gradients(x, self._s, r)[1] - second
        self._x, self._round = x, self._round + 1
