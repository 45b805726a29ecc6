"""The sliding mode observer finds the leader in finite time; the formation error falls at the gain."""

from math import dist

import numpy as np
import pytest
from flockwire_core.law import Heard, LeaderMotion, Observation
from flockwire_laws.sliding_mode import SlidingMode
from law_flights import START, Flight, graph, place, rate, settings

EDGES = [(0, 1, 1.0), (1, 2, 1.0), (0, 2, 0.5)]
PLACES = {1: (1.0, 0.0, 0.0), 2: (-1.0, 0.0, 0.0)}


@pytest.mark.parametrize("seed", range(3))
def test_command_is_the_equation(seed):
    rng = np.random.default_rng(seed)
    law, p = SlidingMode(settings(beta=2.0, gain=1.5)), rng.uniform(-3, 3, 3)
    sent, weights = rng.uniform(-3, 3, (2, 3)), (1.0, 0.5)
    heard = [
        Heard(j, w, False, START, 1, LeaderMotion(tuple(x.tolist())))
        for j, w, x in zip((0, 2), weights, sent, strict=True)
    ]
    site = place(PLACES, 1, (2,))
    decision = law.step(Observation(t=0.0, dt=0.01, position=tuple(p.tolist()), heard=heard, place=site, now=START))
    mean = (sent[0] + 0.5 * sent[1]) / 1.5
    eta = mean + np.sign(p - mean) * np.maximum(np.abs(p - mean) - 0.02, 0.0)
    assert decision.message.position == pytest.approx(eta.tolist(), abs=1e-9)
    assert decision.command == pytest.approx((eta - p) / 0.01 - 1.5 * (p - PLACES[1] - eta), abs=1e-5)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_leader_is_found_in_finite_time_and_never_lost(speed):
    beta, first = 2.0, 3.0
    flight = Flight(
        SlidingMode, {1: (first, 0.0, 0.0)}, [(0, 1, 0.7)], {1: PLACES[1]},
        {0: lambda t: ((-speed * t, 0.0, 0.0), (-speed, 0.0, 0.0), (0.0, 0.0, 0.0))}, {"beta": beta},
    )  # fmt: skip
    errors = flight.fly(4.0, lambda f: abs(f.laws[1]._eta[0] + speed * f.t) if f.laws[1]._eta is not None else first)
    found = np.argmax(errors < 1.1 * speed * 0.01 + 1e-9)  # the leader's pose is one step old
    assert 0.01 * found == pytest.approx(first / (beta - speed), abs=0.03)
    assert errors[found:].max() < 1.1 * speed * 0.01 + 1e-9


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_formation_error_falls_at_the_gain(lag):
    leader = {0: lambda t: ((0.1 * t, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0))}
    starts = {1: (0.3, 0.4, 0.0), 2: (0.5, -0.2, 0.0)}
    flight = Flight(SlidingMode, starts, EDGES, PLACES, leader, {"gain": 1.0}, lag=lag)
    errors = flight.fly(4.0, lambda f: dist(f.p[1], (1.0 + 0.1 * f.t, 0.0, 0.0)))
    assert rate(errors, 0.01, 1.0, 2.5) == pytest.approx(1.0 if not lag else 1.127, rel=0.05)  # s (1 + s lag) = -k
    assert SlidingMode.check(graph((1, 2), EDGES), {}, {})[2] == {"slowest": 3.0}
    assert SlidingMode.check(graph((1, 2), [(1, 2, 1.0), (0, 2, 1.0)]), {}, {})[0]
