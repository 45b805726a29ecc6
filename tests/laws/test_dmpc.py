import numpy as np
import pytest
from flockwire_core.law import SECOND, Heard, Observation
from flockwire_laws import checks
from flockwire_laws.dmpc import Dmpc, Predicted
from flockwire_laws.dmpc_program import solve
from law_flights import Flight, both, graph, place, settings
from scipy.optimize import minimize

CORNERS = {1: (-1.5, -1.5, 1.0), 2: (1.5, -1.5, 1.0), 3: (1.5, 1.5, 1.0), 4: (-1.5, 1.5, 1.0)}
ALL = both([(i, j) for i in CORNERS for j in CORNERS if i < j])


def rolled(free, a):
    """Positions p[1..15] by rolling the double integrator out."""
    p, v, found = free[0] - 0.0, np.zeros(2), []
    shift, speed = np.zeros(2), np.zeros(2)
    for k in range(15):
        shift, speed = shift + 0.2 * speed + 0.02 * a[k], speed + 0.2 * a[k]
        found.append(free[k] + shift)
    assert p.shape == v.shape
    return np.array(found)


@pytest.mark.parametrize("meets", [False, True])
def test_plan_is_the_minimum_of_its_program(meets):
    draw = np.random.default_rng(15)
    p, v, goal, before = np.array([-1.0, 0.1]), np.array([0.3, 0.0]), np.array([1.2, 0.0]), draw.normal(size=2) * 0.1
    times = 0.2 * np.arange(1, 16)
    free = p + np.outer(times, v)
    other = np.array([1.0, 0.0]) - np.outer(times, (0.5, 0.0)) if meets else free + 9.0
    found = solve(1.0, 0.5, free, goal, before, free, [other])
    gaps = np.linalg.norm(free - other, axis=1)
    k = int(np.argmax(gaps < 0.5)) if meets else 0
    n = (free[k] - other[k]) / gaps[k]
    q, s = (1000.0, 100.0) if meets else (1000.0, 10.0)

    def cost(x):
        a = x[:30].reshape(15, 2)
        change = np.diff(np.vstack([before, a]), axis=0)
        e = x[30]
        return (
            q * np.sum((rolled(free, a)[-1] - goal) ** 2) + np.sum(a**2) + s * np.sum(change**2) + e * e - 5e4 * e
        ) / 1e3

    row = {"type": "ineq", "fun": lambda x: n @ (rolled(free, x[:30].reshape(15, 2))[k] - other[k]) - 0.5 - x[30]}
    start = np.concatenate([found.ravel(), [0.0]])
    limits = [(-1.0, 1.0)] * 30 + [(None, 0.0)]
    if meets:
        start[30] = min(0.0, n @ (rolled(free, found)[k] - other[k]) - 0.5)
    best = minimize(cost, 0.5 * start, bounds=limits, constraints=[row] if meets else [], method="SLSQP",
                    options={"ftol": 1e-13, "maxiter": 1000})  # fmt: skip
    assert found == pytest.approx(best.x[:30].reshape(15, 2), abs=5e-3)
    assert cost(start) <= best.fun * (1 + 1e-6) + 1e-9


def test_plan_counts_from_its_deadline_and_is_sampled():
    law, site = Dmpc(settings()), place({1: (1.0, 0.0, 1.0)}, 1)
    first = Observation(position=(0.0, 0.0, 1.0), velocity=(0.0,) * 3, place=site, now=SECOND)
    plan = law.plan(first)
    assert plan.start == SECOND + SECOND // 10
    later = first._replace(plan=plan, now=plan.start + SECOND * 3 // 10)
    decision = law.step(later)
    assert decision.command[:2] == pytest.approx(plan.accelerations[1])
    assert decision.stamp == plan.start
    assert np.array(decision.message.points) == pytest.approx(plan.positions)
    assert law.step(later).message is None
    assert law.step(first).command == (0.0, 0.0, 0.0)
    heard = [Heard(2, 1.0, False, plan.start, 1, Predicted(decision.message.points))]
    assert not np.allclose(law.plan(later._replace(heard=heard)).accelerations, law.plan(later).accelerations)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_four_change_corners_crosswise(lag):
    goals = {i: (-x, -y, z) for i, (x, y, z) in CORNERS.items()}
    start = {**CORNERS, 1: (-1.499, -1.5, 1.0)}
    flight = Flight(Dmpc, start, ALL, goals, lag=lag, dt=0.02)
    flown = flight.fly(14.0, lambda one: one.array)
    gaps = np.linalg.norm(flown[:, :, None] - flown[:, None], axis=-1) + 9 * np.eye(4)
    assert gaps.min() > 0.9 * 0.5
    assert np.linalg.norm(flown[-1] - np.array(list(goals.values())), axis=1).max() < 0.02
    assert all(len(plan[2].accelerations) == 15 for plan in flight.plans.values())


def test_places_nearer_than_r_min_and_pairs_without_plans_are_named():
    assert Dmpc.check(graph(CORNERS, ALL), CORNERS, {}) == ([], [], {})
    near = CORNERS | {2: (-1.5, -1.1, 1.9), 4: (-1.5, -1.0, 1.0)}
    problems, notes, _ = Dmpc.check(graph(CORNERS, ALL), near, {})
    assert (problems[0], notes) == (checks.TOO_NEAR.format(1, 2, 0.4, 0.5), [])
    assert not any("drones 1 and 4" in problem for problem in problems)  # r_min apart
    problems, notes, _ = Dmpc.check(graph(CORNERS, ALL[2:]), CORNERS | {2: near[2]}, {})
    assert (problems, notes) == ([], [checks.UNHEARD.format(1, 6)])
