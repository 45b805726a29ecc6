import numpy as np
import pytest
from flockwire_core.law import Heard, Observation
from flockwire_laws.aggregative import Aggregative
from flockwire_laws.aggregative_task import Tracker
from law_flights import Flight, both, graph, place, settings

RING = both([(i % 6 + 1, (i + 1) % 6 + 1) for i in range(6)], 1 / 3)
R = {i: (2 * np.cos(i), 2 * np.sin(i), 0.3 * i) for i in range(1, 7)}
TASK = {"weights": [1.0, 2.0, 0.5], "target": [1.0, -1.0, 0.5], "period": 0.05, "alpha": 0.05}


def minimum():
    r, b, (g1, g2, g3) = np.array(list(R.values())), np.array(TASK["target"]), TASK["weights"]
    blocks = np.zeros((6, 6))  # of the gradient of the sum, solved at once
    for i in range(6):
        e, mean = np.eye(6)[i], np.full(6, 1 / 6)
        blocks += g1 * np.outer(e, e) + g2 * np.outer(mean, mean) + g3 * np.outer(e - mean, e - mean)
    right = g1 * r + g2 * np.tile(b, (6, 1))
    return np.linalg.solve(blocks, right / 1.0)


def test_first_round_is_the_equations():
    draw = np.random.default_rng(11)
    x, s, y = draw.normal(size=3), draw.normal(size=(2, 3)), draw.normal(size=(2, 3))
    law, site = Aggregative(settings(**TASK)), place(R, 1, (2, 6))
    first = law.step(Observation(t=0.0, dt=0.01, position=tuple(x), place=site))
    b, r = np.array(TASK["target"]), np.array(R[1])
    assert first.message.s == pytest.approx(x)
    assert first.message.y == pytest.approx(2.0 * (x - b), abs=1e-9)
    news = [
        Heard(j, 1 / 3, False, 0, 1, Tracker(site.start, 0, tuple(s[k]), tuple(y[k]))) for k, j in enumerate((2, 6))
    ]
    assert law.step(Observation(t=0.06, dt=0.01, position=tuple(x), place=site, news=news[:1])).message is None  # waits
    found = law.step(Observation(t=0.07, dt=0.01, position=tuple(x), place=site, news=news[1:]))
    grown = x - 0.05 * ((x - r) + 0.5 * (x - x) + 2.0 * (x - b))
    s1 = (x + s.sum(axis=0)) / 3 + grown - x
    y1 = (2.0 * (x - b) + y.sum(axis=0)) / 3 + 2.0 * (s1 - b) - 0.5 * (grown - s1) - 2.0 * (x - b)
    assert (found.message.round, found.message.s, found.message.y) == (
        1,
        pytest.approx(s1, abs=1e-9),
        pytest.approx(y1, abs=1e-9),
    )
    assert found.command == pytest.approx((grown - x) / 0.05, abs=1e-5)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_ring_converges_linearly_and_keeps_both_means(lag):
    draw = np.random.default_rng(12)
    flight = Flight(
        Aggregative, dict(enumerate(draw.normal(size=(6, 3)), 1)), RING, R, parameters={**TASK, "period": 0.1}, lag=lag
    )
    rounds = {}

    def record(one):
        for law in one.laws.values():
            rounds.setdefault(law._round, []).append((law._x, law._s, law._y))

    flight.fly(25.0, lambda one: record(one) or 0.0)
    b, (g1, g2, g3) = np.array(TASK["target"]), TASK["weights"]
    mean = (g1 * np.mean(list(R.values()), axis=0) + g2 * b) / (g1 + g2)
    goal = (g1 * np.array(list(R.values())) + g3 * mean - g2 * (mean - b)) / (g1 + g3)
    assert goal == pytest.approx(minimum(), abs=1e-2)
    x, s, y = np.moveaxis(np.array([[law._x, law._s, law._y] for law in flight.laws.values()]), 1, 0)
    assert x == pytest.approx(goal, abs=1e-3)
    assert flight.array == pytest.approx(goal, abs=2e-3)
    assert s.mean(axis=0) == pytest.approx(x.mean(axis=0), abs=1e-12)
    assert y.mean(axis=0) == pytest.approx((g2 * (s - b) - g3 * (x - s)).mean(axis=0), abs=1e-12)


def test_lost_message_stops_the_rounds_instead_of_moving_the_means():
    flight = Flight(Aggregative, dict.fromkeys(R, np.zeros(3)), RING, R, parameters=TASK)
    flight.fly(1.0)
    kept = flight.inward[1].pop(2)
    flight.fly(1.0)
    rounds = [law._round for law in flight.laws.values()]
    assert kept and max(rounds) - min(rounds) <= 3
    assert max(rounds) < 30


def test_check_wants_doubly_stochastic_weights():
    assert "Metropolis" in Aggregative.check(graph(R, both([(1, 2), (2, 3), (3, 4), (4, 5), (5, 6)])), {}, {})[0][0]
    assert not Aggregative.check(graph(R, RING), {}, {})[0]
