import numpy as np
import pytest
from flockwire_core.law import Observation, Sense
from flockwire_laws.rigid import Rigid, RigidInSpace
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, both, graph, place, rate, settings, sight

SQUARE = {1: (0.0, 0.0, 0.0), 2: (1.5, 0.0, 0.0), 3: (1.5, 1.5, 0.0), 4: (0.0, 1.5, 0.0)}
BRACED = both([(1, 2), (2, 3), (3, 4), (4, 1), (1, 3)])


@tries(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_command_is_minus_the_gradient_in_any_axes(seed):
    draw = np.random.default_rng(seed)
    p, h = draw.normal(size=(4, 3)), draw.normal(size=(4, 3))
    site = place(dict(enumerate(h, 1)), 1, (2, 3, 4))

    def potential(x):
        lengths = np.sum((p[1:] - x) ** 2, axis=1) - np.sum((h[1:] - h[0]) ** 2, axis=1)
        return 0.3 / 4 * np.sum(lengths**2)

    steps = 1e-5 * np.eye(3)
    gradient = np.array([(potential(p[0] + s) - potential(p[0] - s)) / 2e-5 for s in steps])
    turn = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    for axes in (np.eye(3), turn):
        seen = [sight(Sense.POSITION, j + 1, 1.0, False, axes @ (p[j] - p[0]), np.zeros(3)) for j in (1, 2, 3)]
        found = np.array(RigidInSpace(settings(gain=0.3)).step(Observation(place=site, neighbours=seen)).command)
        assert axes.T @ found == pytest.approx(-gradient, abs=1e-5)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_shape_converges_at_its_rate_and_centroid_stays(lag):
    draw = np.random.default_rng(9)
    start = {i: np.array(h) + 0.15 * draw.normal(size=3) * (1, 1, 0) for i, h in SQUARE.items()}
    flight = Flight(Rigid, start, BRACED, SQUARE, lag=lag)

    def lengths(x):
        return np.array([np.linalg.norm(x[i - 1] - x[j - 1]) for i, j, _ in BRACED])

    flown = flight.fly(20.0, lambda one: one.array)
    goal = lengths(np.array(list(SQUARE.values())))
    errors = np.array([np.linalg.norm(lengths(x) - goal) for x in flown])
    problems, _, rates = Rigid.check(flight.graph, SQUARE, {})
    assert not problems
    assert errors[-1] < 1e-3
    slowest = rates["slowest"]
    assert rate(errors, 0.01, 8.0, 14.0) == pytest.approx(
        (1 - np.sqrt(1 - 4 * lag * slowest)) / (2 * lag) if lag else slowest, rel=0.05
    )
    assert np.abs(flown.mean(axis=1) - flown[0].mean(axis=0)).max() < 1e-3
    moment = sum(
        np.cross(flight.p[i] - flown[-1].mean(axis=0), np.array(d.command)) for i, d in flight.decisions.items()
    )
    assert np.abs(moment).max() < 1e-9


def test_collinear_start_stays_collinear():
    flight = Flight(Rigid, {i: (0.9 * i, 0.0, 0.0) for i in SQUARE}, BRACED, SQUARE)
    flight.fly(20.0)
    assert not flight.array[:, 1:].any()
    assert max(decision.error for decision in flight.decisions.values()) > 0.3


def test_check_refuses_a_flexible_graph():
    assert "rank 5, has 4" in Rigid.check(graph(SQUARE, both([(1, 2), (2, 3), (3, 4), (4, 1)])), SQUARE, {})[0][0]
    line = {i: (float(i), 0.0, 0.0) for i in SQUARE}
    assert "rank" in Rigid.check(graph(SQUARE, BRACED), line, {})[0][0]
    assert "rank 6" in RigidInSpace.check(graph(SQUARE, BRACED), SQUARE, {})[0][0]
