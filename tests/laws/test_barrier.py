import numpy as np
import pytest
from flockwire_core.law import Observation, Sense
from flockwire_laws.barrier import Barrier
from flockwire_laws.barrier_first_order import FirstOrder
from flockwire_laws.quadratic import minimise
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, graph, place, settings, sight
from scipy.optimize import minimize

STATE = Sense.POSITION | Sense.VELOCITY


@tries(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_program_is_solved(seed):
    draw = np.random.default_rng(seed)
    n, m = draw.integers(2, 8), draw.integers(1, 14)
    root = draw.normal(size=(n, n))
    hessian, gradient = root @ root.T + 0.1 * np.eye(n), draw.normal(size=n)
    rows = draw.normal(size=(m, n))
    limits = rows @ draw.normal(size=n) - draw.uniform(0, 1, m)
    found = minimise(hessian, gradient, rows, limits)
    other = minimize(lambda x: 0.5 * x @ hessian @ x + gradient @ x, np.zeros(n), jac=lambda x: hessian @ x + gradient,
                     constraints={"type": "ineq", "fun": lambda x: rows @ x - limits, "jac": lambda x: rows},
                     method="SLSQP", options={"ftol": 1e-12, "maxiter": 500})  # fmt: skip
    assert (rows @ found - limits).min() > -1e-7
    cost = lambda x: 0.5 * x @ hessian @ x + gradient @ x  # noqa: E731
    assert cost(found) <= cost(other.x) + 1e-6
    assert minimise(np.eye(1), np.zeros(1), np.array([[1.0], [-1.0]]), np.array([1.0, 0.0])) is None


@tries(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_command_solves_the_program_of_the_equation(seed):
    draw = np.random.default_rng(seed)
    p, v, goal = draw.uniform(-1, 1, 2), 0.3 * draw.normal(size=2), draw.uniform(-3, 3, 2)
    angles = draw.uniform(0, 6.2, 3)
    dp = [(0.7 + draw.uniform(0, 2)) * np.array([np.cos(a), np.sin(a)]) for a in angles]
    dv = 0.3 * draw.normal(size=(3, 2))
    flat = lambda x: np.array([*x, 0.0])  # noqa: E731
    seen = [sight(STATE, -1, 0.0, False, -flat(a), -flat(b)) for a, b in zip(dp, dv, strict=True)]
    observation = Observation(
        position=tuple(flat(p)), velocity=tuple(flat(v)), around=seen, place=place({1: flat(goal)}, 1)
    )
    towards = goal - p
    towards = towards / max(1.0, np.linalg.norm(towards))
    wanted = 2.0 * (towards - v)
    bounds = []
    for a, b in zip(dp, dv, strict=True):
        r, s = np.linalg.norm(a), a @ b
        h = np.sqrt(4 * (r - 0.5)) + s / r
        bounds.append(0.5 * h**3 * r + b @ b - (s / r) ** 2 + 2 * s / np.sqrt(4 * (r - 0.5)))
    other = minimize(lambda u: np.sum((u - wanted) ** 2), np.zeros(2), bounds=[(-1, 1)] * 2, method="SLSQP",
                     constraints={"type": "ineq", "fun": lambda u: np.array(dp) @ u + 0.5 * np.array(bounds)},
                     options={"ftol": 1e-14})  # fmt: skip
    if other.success:
        assert Barrier(settings()).step(observation).command[:2] == pytest.approx(other.x, abs=1e-3)


@pytest.mark.parametrize(("law", "lag"), [(Barrier, 0.0), (Barrier, 0.1), (FirstOrder, 0.0)])
def test_crossing_drones_keep_their_distance_and_arrive(law, lag):
    angles = np.arange(5) * 2 * np.pi / 5
    start = {i + 1: (2 * np.cos(a), 2 * np.sin(a), 1.0) for i, a in enumerate(angles)}
    goals = {i + 1: (2 * np.cos(a + 2.6), 2 * np.sin(a + 2.6), 1.0) for i, a in enumerate(angles)}
    flight = Flight(law, start, [], goals, parameters={"gamma": 5.0} if law is FirstOrder else {}, lag=lag, dt=0.02)
    gaps = flight.fly(30.0, lambda one: np.min(np.linalg.norm(one.array[:, None] - one.array, axis=-1) + 9 * np.eye(5)))
    assert 0.5 - 2e-3 < gaps.min() < 1.0
    if law is Barrier:
        assert flight.array == pytest.approx(np.array(list(goals.values())), abs=0.02)


def test_alone_it_flies_as_it_wants_and_check_knows_its_radius():
    observation = Observation(position=(0.0, 0.0, 1.0), velocity=(0.1, 0.0, 0.0), place=place({1: (0.3, 0.0, 1.0)}, 1))
    assert Barrier(settings()).step(observation).command == pytest.approx((0.4, 0.0, 0.0), abs=1e-9)
    assert not Barrier.check(graph((1,), []), {}, {})[0]
    assert "beyond its radius" in Barrier.check(graph((1,), []), {}, {"speed": 2.0})[0][0]
