import numpy as np
import pytest
from flockwire_core.control.graph import Graph
from flockwire_core.law import Heard, Observation, Sense
from flockwire_laws.bearing import Bearing
from flockwire_laws.manoeuvre import Manoeuvre
from flockwire_laws.relative import Acceleration
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, at, both, graph, place, rate, settings, sight

SQUARE = {1: (0.0, 0.0, 0.0), 2: (2.0, 0.0, 0.0), 3: (2.0, 2.0, 0.0), 4: (0.0, 2.0, 0.0)}
BRACED = both([(1, 2), (2, 3), (3, 4), (4, 1), (1, 3)])
CUBE = {i + 1: (float(i & 1), float(i >> 1 & 1), float(i >> 2 & 1)) for i in range(8)}
CUBE_EDGES = both([(i + 1, j + 1) for i in range(8) for j in range(i) if bin(i ^ j).count("1") == 1])
LED = {3: (1.0, 1.0, 0.0), 4: (1.0, -1.0, 0.0), 5: (1.5, 2.0, 0.0)}
LED_EDGES = [*both([(3, 4), (4, 5), (3, 5)]), (1, 4, 1.0), (2, 3, 1.0), (1, 3, 1.0), (2, 4, 1.0), (1, 5, 1.0)]
LEADERS = {"1": [0.0, 0.0, 0.0], "2": [2.0, 0.0, 0.0]}


@tries(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_commands_are_the_equations(seed):
    draw = np.random.default_rng(seed)
    p, v, a, h = draw.normal(size=(4, 4, 3))
    seen = [sight(Sense(13), j + 1, 1.0, False, p[j] - p[0], v[j] - v[0]) for j in (1, 2, 3)]
    heard = [Heard(j + 1, 1.0, False, 0, 1, Acceleration(tuple(a[j]))) for j in (1, 2, 3)]
    observation = Observation(place=place(dict(enumerate(h, 1)), 1, (2, 3, 4)), neighbours=seen, heard=heard)
    g = [(p[j] - p[0]) / np.linalg.norm(p[j] - p[0]) for j in (1, 2, 3)]
    wanted = [(h[j] - h[0]) / np.linalg.norm(h[j] - h[0]) for j in (1, 2, 3)]
    free = -sum(w - x * (x @ w) for x, w in zip(g, wanted, strict=True))
    assert Bearing(settings()).step(observation).command == pytest.approx(free, abs=1e-5)
    fixed = 0.7 * (sum(g) - sum(wanted))
    assert Bearing(settings(anchored=True, gain=0.7)).step(observation).command == pytest.approx(fixed, abs=1e-5)
    across = [np.eye(3) - np.outer(w, w) for w in wanted]
    terms = [q @ (a[j] - 0.8 * (p[0] - p[j]) - 1.9 * (v[0] - v[j])) for q, j in zip(across, (1, 2, 3), strict=True)]
    moving = np.linalg.solve(sum(across), sum(terms))
    assert Manoeuvre(settings(kp=0.8, kv=1.9)).step(observation).command == pytest.approx(moving, abs=1e-5)


@pytest.mark.parametrize(("lag", "drift"), [(0.0, 1e-3), (0.1, 0.019)])
def test_bearings_alone_keep_centroid_and_scale_and_converge_at_the_rate(lag, drift):
    draw = np.random.default_rng(8)
    start = {i: np.array(h) + 0.3 * draw.normal(size=3) * (1, 1, 0) for i, h in SQUARE.items()}
    flight = Flight(Bearing, start, BRACED, SQUARE, lag=lag)
    scale = lambda x: np.sqrt(np.mean(np.sum((x - x.mean(axis=0)) ** 2, axis=1)))  # noqa: E731
    flown = flight.fly(30.0, lambda one: one.array)
    assert flown.mean(axis=1) == pytest.approx(np.tile(flown[0].mean(axis=0), (3001, 1)), abs=1e-3)
    assert abs(scale(flown[-1]) - scale(flown[0])) < drift
    factor = scale(flown[0]) / scale(np.array(list(SQUARE.values())))
    goal = factor * (np.array(list(SQUARE.values())) - (1, 1, 0)) + flown[-1].mean(axis=0)
    assert np.linalg.norm(flown[-1] - goal, axis=1).max() < max(0.01, 2 * drift)
    errors = np.linalg.norm(flown - flown[-1], axis=(1, 2))
    places = {i: factor * np.array(h) for i, h in SQUARE.items()}
    slowest = Bearing.check(flight.graph, places, {})[2]["slowest"]
    assert rate(errors, 0.01, 10.0, 16.0) == pytest.approx(slowest / (1 - lag * slowest), rel=0.05)


def test_leaders_anchor_the_bearings():
    parameters = {"anchored": True, "gain": 5.0, "leader_places": LEADERS}
    start = {i: np.add(h, (0.3, -0.2 * i, 0.0)) for i, h in LED.items()}
    flight = Flight(Bearing, start, LED_EDGES, LED, {1: at((0.0, 0.0, 0.0)), 2: at((2.0, 0.0, 0.0))}, parameters)
    errors = flight.fly(30.0, lambda one: np.linalg.norm(one.array - list(LED.values())))
    problems, _, rates = Bearing.check(flight.graph, LED, parameters)
    assert not problems
    assert errors[-1] < 1e-2
    assert rate(errors, 0.01, 12.0, 20.0) == pytest.approx(rates["slowest"], rel=0.05)


def test_leaders_move_and_scale_the_formation():
    def leader(side):
        def path(t):
            grown, speed = 1.0 + 0.1 * np.sin(0.4 * t), 0.04 * np.cos(0.4 * t)
            return (side * grown + 0.2 * t, 0, 0), (side * speed + 0.2, 0, 0), (-side * 0.016 * np.sin(0.4 * t), 0, 0)

        return path

    flight = Flight(Manoeuvre, {i: np.array(h) - (1, 0, 0) for i, h in LED.items()}, LED_EDGES, LED,
                    {1: leader(-1.0), 2: leader(1.0)}, {"leader_places": LEADERS})  # fmt: skip
    flight.fly(25.0)
    grown = 1.0 + 0.1 * np.sin(0.4 * flight.t)
    goal = (np.array(list(LED.values())) - (1, 0, 0)) * grown + (0.2 * flight.t, 0, 0)
    assert np.linalg.norm(flight.array - goal, axis=1).max() < 0.02


def test_check_refuses_a_flexible_and_a_directed_graph():
    assert "not bearing rigid" in Bearing.check(graph(CUBE, CUBE_EDGES), CUBE, {})[0][0]
    assert not Bearing.check(graph(SQUARE, BRACED), SQUARE, {})[0]
    assert any("symmetric" in one for one in Bearing.check(graph(SQUARE, BRACED[:-1]), SQUARE, {})[0])
    assert any("leaders" in one for one in Bearing.check(graph(SQUARE, BRACED), SQUARE, {"anchored": True})[0])
    one_leads = Graph((2, 3, 4), tuple((j, i, 1.0) for j, i, *_ in BRACED if i != 1), (1,))
    assert any("leaders" in one for one in Bearing.check(one_leads, SQUARE, {})[0])  # it would keep no scale


def test_shifted_world_gives_the_same_commands():
    one, other = (
        Flight(Bearing, {i: np.array(h) * 1.1 + s * i * 0.1 for i, h in SQUARE.items()}, BRACED, SQUARE) for s in (0, 0)
    )
    for flight, shift in ((one, 0.0), (other, np.array([3.0, -2.0, 1.0]))):
        flight.p = {i: p + shift for i, p in flight.p.items()}
        flight.step()
    for i in SQUARE:
        assert one.decisions[i].command == pytest.approx(other.decisions[i].command, abs=1e-9)
