import numpy as np
import pytest
from flockwire_core.law import Heard, Observation, Sense
from flockwire_laws.containment import AtRest, Containment, Sliding
from flockwire_laws.relative import Velocity
from flockwire_laws.spectrum import NO_TREE
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, at, graph, place, rate, settings, sight

EDGES = [(1, 4, 1.0), (2, 4, 1.5), (4, 5, 1.0), (2, 5, 1.0), (5, 6, 1.0), (3, 6, 1.0), (6, 5, 0.5)]
CORNERS = {1: (0.0, 0.0, 0.0), 2: (3.0, 0.0, 0.0), 3: (0.0, 3.0, 0.0)}
START = {4: (-2.0, 1.0, 0.5), 5: (4.0, -1.0, 0.0), 6: (1.0, 5.0, -0.5)}


def targets(leaders):
    w = np.zeros((7, 7))
    for j, i, weight in EDGES:
        w[i, j] = weight
    block = np.diag(w[4:].sum(axis=1)) - w[4:, 4:]
    return np.linalg.solve(block, w[4:, 1:4] @ np.array([leaders[i] for i in (1, 2, 3)]))


@tries(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_commands_are_the_equations(seed):
    draw = np.random.default_rng(seed)
    p, y, w = draw.normal(size=(4, 3)), draw.normal(size=(4, 3)), draw.uniform(0.2, 2.0, 4)
    seen = [sight(Sense.POSITION, j + 1, w[j], False, p[j] - p[0], np.zeros(3)) for j in (1, 2, 3)]
    heard = [Heard(j + 1, w[j], False, 0, 1, Velocity(tuple(y[j]))) for j in (1, 2, 3)]
    observation = Observation(dt=0.01, place=place({1: np.zeros(3)}, 1), neighbours=seen, heard=heard)
    delta = w[1:].sum() * p[0] - w[1:] @ p[1:]
    given_ = settings(gain=0.6, beta=0.4)
    assert AtRest(given_).step(observation).command == pytest.approx(-0.6 * delta, abs=1e-5)
    for dt in (0.0, 0.01):
        if np.abs(delta).min() > 0.4 * dt * w[1:].sum():
            found = Sliding(given_).step(observation._replace(dt=dt)).command
            assert found == pytest.approx(-0.6 * delta - 0.4 * np.sign(delta), abs=1e-5)
    law, towards = Containment(given_), w[1:] @ y[1:] / w[1:].sum()
    assert law.step(observation).command == pytest.approx(-0.6 * delta, abs=1e-5)  # y(0) = 0
    y1 = np.clip(towards, -0.004, 0.004)
    assert law.step(observation).command == pytest.approx(y1 - 0.6 * delta, abs=1e-5)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_followers_end_within_the_hull_at_the_rate(lag):
    flight = Flight(AtRest, START, EDGES, leaders={i: at(p) for i, p in CORNERS.items()}, lag=lag)
    errors = flight.fly(20.0, lambda one: np.linalg.norm(one.array - targets(CORNERS)))
    assert errors[-1] < 1e-3
    slowest = AtRest.check(flight.graph, {}, {})[2]["slowest"]
    expected = (1 - np.sqrt(1 - 4 * lag * slowest)) / (2 * lag) if lag else slowest
    assert rate(errors, 0.01, 4.0, 9.0) == pytest.approx(expected, rel=0.05)


def moving(i):
    """Leaders that fly on, each a little differently, within 0.3 m/s and 0.1 m/s^2 per axis."""
    c = np.array(CORNERS[i])

    def path(t):
        w = 0.3 + 0.05 * i
        x = np.add(c, (0.2 * t, 0.3 * np.sin(w * t), 0.0))
        return x, (0.2, 0.3 * w * np.cos(w * t), 0.0), (0.0, -0.3 * w * w * np.sin(w * t), 0.0)

    return path


@pytest.mark.parametrize(("law", "beta", "bound", "most"), [(Sliding, 0.5, 20.0, 0.02), (Containment, 0.3, 14.0, 0.01)])
def test_moving_leaders_keep_them_in_the_hull_after_the_bound(law, beta, bound, most):
    flight = Flight(law, START, EDGES, leaders={i: moving(i) for i in CORNERS}, parameters={"beta": beta})
    errors = flight.fly(24.0, lambda one: np.abs(one.array - targets({i: moving(i)(one.t)[0] for i in CORNERS})).max())
    assert errors[0] > 2.0
    assert errors[round(bound / 0.01) :].max() < most


def test_static_law_trails_moving_leaders():
    def drifting(corner):
        return lambda t: (np.add(corner, (0.2 * t, 0, 0)), (0.2, 0, 0), (0, 0, 0))

    path = {i: drifting(c) for i, c in CORNERS.items()}
    flight = Flight(AtRest, START, EDGES, leaders=path)
    flight.fly(20.0)
    behind = targets({i: f(flight.t)[0] for i, f in path.items()}) - flight.array
    assert behind[:, 0].min() > 0.2 / 2.5


def test_shifted_world_and_a_follower_that_no_leader_reaches():
    commands = []
    for shift in (np.zeros(3), np.array([5.0, -4.0, 1.0])):
        flight = Flight(Containment, {i: np.array(p) + shift for i, p in START.items()}, EDGES,
                        leaders={i: at(np.array(p) + shift) for i, p in CORNERS.items()})  # fmt: skip
        flight.step()
        commands.append(np.array([d.command for d in flight.decisions.values()]))
    assert commands[0] == pytest.approx(commands[1], abs=1e-9)
    assert NO_TREE in Containment.check(graph(START, [(1, 4, 1.0), (2, 4, 1.0), (5, 6, 1.0), (6, 5, 1.0)]), {}, {})[0]
