import numpy as np
import pytest
from flockwire_core.law import Heard, Observation, Sense
from flockwire_laws.affine import Accelerating, Affine, AtRest
from flockwire_laws.relative import Acceleration, Velocity
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, at, graph, place, rate, settings, sight

R = np.array([(2, 0, 0), (1, 1, 0), (1, -1, 0), (0, 1, 0), (0, -1, 0), (-1, 1, 0), (-1, -1, 0)], float)
PAIRS = [(1, 2), (1, 3), (1, 4), (1, 5), (2, 4), (3, 5), (3, 6), (4, 5), (4, 6), (2, 7), (5, 7), (6, 7)]


def stresses():
    """The one stress of the source's graph, |omega| = 1, by its definition: the null space of the equilibrium."""
    balance = np.zeros((14, 12))
    for column, (i, j) in enumerate(PAIRS):
        balance[2 * i - 2 : 2 * i, column] = (R[i - 1] - R[j - 1])[:2]
        balance[2 * j - 2 : 2 * j, column] = -(R[i - 1] - R[j - 1])[:2]
    omega = np.linalg.svd(balance)[2][-1]
    return omega * np.sign(omega[0])


EDGES = [(j, i, float(w)) for (a, b), w in zip(PAIRS, stresses(), strict=True) for j, i in ((a, b), (b, a)) if i > 3]
PLACES = {i: tuple(R[i - 1]) for i in range(4, 8)}
LEADER_PLACES = {"leader_places": {str(i): R[i - 1].tolist() for i in (1, 2, 3)}}


def image(i, t):
    """4 m in 14 s with a quarter turn, r half as large, from rest to rest."""
    s = min(max(t / 14.0, 0.0), 1.0)
    s = s**3 * (10 - 15 * s + 6 * s**2)
    c, n = np.cos(np.pi / 2 * s), np.sin(np.pi / 2 * s)
    return np.array([[c, -n, 0], [n, c, 0], [0, 0, 1]]) @ R[i - 1] / 2 + (4 * s, 0, 0)


def leader(i):
    """The path of leader i, its derivatives by differences."""

    def path(t):
        a, b, c = image(i, t - 1e-3), image(i, t), image(i, t + 1e-3)
        return b, (c - a) / 2e-3, (c - 2 * b + a) / 1e-6

    return path


@tries(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_commands_are_the_equations(seed):
    draw = np.random.default_rng(seed)
    p, v, a = draw.normal(size=(3, 4, 3))
    w = draw.uniform(0.2, 2.0, 4) * (1, 1, -0.1, 1)
    seen = [sight(Sense(12), j + 1, w[j], False, p[j] - p[0], v[j] - v[0]) for j in (1, 2, 3)]
    site = place({1: np.zeros(3)}, 1)

    def found(law, message):
        heard = law.information.message and [
            Heard(j + 1, w[j], False, 0, 1, message(tuple(x))) for j, x in ((1, a[1]), (2, a[2]), (3, a[3]))
        ]
        return (
            law(settings(gain=0.6, kp=0.7, kv=2.1))
            .step(Observation(place=site, neighbours=seen, heard=heard or ()))
            .command
        )

    total, pull, slow = w[1:].sum(), w[1:] @ p[1:] - w[1:].sum() * p[0], w[1:] @ v[1:] - w[1:].sum() * v[0]
    assert found(AtRest, Velocity) == pytest.approx(0.6 * pull, abs=1e-5)
    assert found(Affine, Velocity) == pytest.approx((w[1:] @ a[1:] + 0.6 * pull) / total, abs=1e-5)
    assert found(Accelerating, Acceleration) == pytest.approx(
        (w[1:] @ a[1:] + 0.7 * pull + 2.1 * slow) / total, abs=1e-5
    )


@pytest.mark.parametrize(
    ("law", "lag", "most"), [(Affine, 0.0, 0.045), (Accelerating, 0.0, 0.03), (Accelerating, 0.1, 0.045)]
)
def test_followers_make_the_affine_image_that_three_leaders_show(law, lag, most):
    flight = Flight(law, {i: R[i - 1] / 2 for i in range(4, 8)}, EDGES, PLACES,
                    {i: leader(i) for i in (1, 2, 3)}, lag=lag)  # fmt: skip
    wanted = lambda one: np.linalg.norm(one.array - [image(i, one.t) for i in range(4, 8)], axis=1).max()  # noqa: E731
    assert flight.fly(16.0, wanted).max() < most
    assert flight.array[0] == pytest.approx([3.5, 0.0, 0.0], abs=most)


def test_errors_fall_at_the_rates():
    start = {i: R[i - 1] + (0.5, 0.3 * i, 0.0) for i in range(4, 8)}
    resting = {i: at(tuple(R[i - 1])) for i in (1, 2, 3)}
    moving = Flight(Affine, start, EDGES, PLACES, resting, dt=0.002)
    errors = moving.fly(9.0, lambda one: np.linalg.norm(one.array - R[3:]))
    assert rate(errors, 0.002, 3.0, 8.0) == pytest.approx(
        Affine.check(moving.graph, PLACES, {})[2]["slowest"], rel=0.05
    )
    still = Flight(AtRest, start, EDGES, PLACES, resting, {"gain": 20.0})
    errors = still.fly(20.0, lambda one: np.linalg.norm(one.array - R[3:]))
    assert rate(errors, 0.01, 8.0, 18.0) == pytest.approx(20.0 * 0.0235, rel=0.05)
    assert AtRest.check(still.graph, PLACES, {"gain": 20.0})[2]["slowest"] == pytest.approx(0.47, rel=0.01)


def test_check_names_balance_definiteness_and_feed_forward():
    problems, notes, _ = Affine.check(graph(PLACES, EDGES), PLACES, LEADER_PLACES)
    assert not problems
    assert "0.932" in notes[0]
    wrong = [(j, i, abs(w)) for j, i, w in EDGES]
    assert any("balance" in one for one in Affine.check(graph(PLACES, wrong), PLACES, LEADER_PLACES)[0])
    negative = [(j, i, -w) for j, i, w in EDGES]
    assert any("positive definite" in one for one in Affine.check(graph(PLACES, negative), PLACES, {})[0])
    few = [edge for edge in EDGES if edge[0] != 3]
    assert any("3 are needed" in one for one in Affine.check(graph(PLACES, few), PLACES, {})[0])
    far = [(1, 2, 1.0), (2, 3, -0.8), (3, 2, -0.8)]
    assert (
        "must be below 1"
        in Affine.check(graph((2, 3), [*far, (4, 3, 1.2), (5, 3, 1.0)]), {2: (0, 0, 0), 3: (1, 0, 0)}, {})[1][0]
    )


def test_shifted_world_gives_the_same_commands():
    for law in (Affine, Accelerating):
        commands = []
        for shift in (np.zeros(3), np.array([5.0, -4.0, 1.0])):
            resting = {i: at(tuple(R[i - 1] + shift)) for i in (1, 2, 3)}
            flight = Flight(law, {i: R[i - 1] * 1.3 + shift for i in PLACES}, EDGES, PLACES, resting)
            flight.step()
            commands.append(np.array([d.command for d in flight.decisions.values()]))
        assert commands[0] == pytest.approx(commands[1], abs=1e-9)
