import numpy as np
import pytest
from flockwire_core.law import Observation, Sense
from flockwire_laws import checks
from flockwire_laws.arena import braking
from flockwire_laws.vasarhelyi import Vasarhelyi
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, graph, place, settings, sight

STATE = Sense.POSITION | Sense.VELOCITY
PAPER = {"length": 1.0, "speed": 1.0}


def allowed(r, a, p):
    return np.where(r <= 0, 0.0, np.where(r * p < a / p, r * p, np.sqrt(np.maximum(2 * a * r - a**2 / p**2, 0))))


@tries(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_command_is_the_equation(seed):
    draw = np.random.default_rng(seed)
    r, v = draw.uniform(-40, 40, (6, 3)) * (1, 1, 0), draw.normal(size=(6, 3)) * (3, 3, 0)
    dr, dv = r[0] - r[1:], v[1:] - v[0]
    far, fast = np.linalg.norm(dr, axis=1), np.linalg.norm(dv, axis=1)
    u = 4.0 * v[0] / np.linalg.norm(v[0])
    u = u + np.sum(np.where(far < 25.6, 0.13 * (25.6 - far) / far, 0.0)[:, None] * dr, axis=0)
    slack = np.maximum(0.63, allowed(far - 85.3, 4.16, 3.2))
    u = u + np.sum(np.where(fast > slack, 0.05 * (fast - slack) / fast, 0.0)[:, None] * dv, axis=0)
    for normal, gap in (
        ((1, 0, 0), r[0][0] + 50),
        ((-1, 0, 0), 50 - r[0][0]),
        ((0, 1, 0), r[0][1] + 50),
        ((0, -1, 0), 50 - r[0][1]),
    ):
        shill = 13.6 * np.array(normal) - v[0]
        size, limit = np.linalg.norm(shill), allowed(gap - 0.3, 5.3, 3.55)
        u = u + (max(size - limit, 0.0) / size) * shill
    u = u * min(1.0, 6.0 / np.linalg.norm(u))
    seen = [sight(STATE, -1, 0.0, False, -x, y) for x, y in zip(dr, dv, strict=True)]
    observation = Observation(position=tuple(r[0]), velocity=tuple(v[0]), around=seen, place=place({1: np.zeros(3)}, 1))
    law = Vasarhelyi(settings(**PAPER, arena=[[-50.0, -50.0], [50.0, 50.0]]))
    assert law.step(observation).command == pytest.approx(u, abs=1e-5)


@pytest.mark.parametrize(("r", "expected"), [(-1.0, 0.0), (0.1, 0.32), (10.0, np.sqrt(83.2 - (4.16 / 3.2) ** 2))])
def test_braking_curve(r, expected):
    assert braking(r, 4.16, 3.2) == pytest.approx(expected)


def test_in_open_air_all_fly_one_way_at_the_wanted_speed():
    draw = np.random.default_rng(6)
    flight = Flight(Vasarhelyi, dict(enumerate(draw.uniform(-2, 2, (6, 3)) * (1, 1, 0), 1)), [], lag=0.3,
                    parameters={"frict": [85.3, 0.2, 0.63, 3.2, 4.16]})  # fmt: skip
    flight.fly(40.0)
    v = np.array(list(flight.v.values()))
    assert np.linalg.norm(v, axis=1) == pytest.approx(np.full(6, 0.6), rel=0.05)
    assert np.linalg.norm(v - v.mean(axis=0), axis=1).max() < 0.63 * 0.15


@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_arena_keeps_them_in_and_aligned(lag):
    draw = np.random.default_rng(7)
    flight = Flight(Vasarhelyi, dict(enumerate(draw.uniform(-3, 3, (6, 3)) * (1, 1, 0), 1)), [], lag=lag,
                    parameters={"arena": [[-5.0, -5.0], [5.0, 5.0]]}, dt=0.02)  # fmt: skip
    flown = flight.fly(60.0, lambda one: [one.array, np.array(list(one.v.values()))])
    p, v = flown[:, 0], flown[1000:, 1]
    assert np.abs(p).max() < 5.0
    n = v / np.linalg.norm(v, axis=-1, keepdims=True)
    correlation = (np.einsum("tid,tjd->t", n, n) - 6) / 30
    assert correlation.mean() > 0.6
    assert np.linalg.norm(v, axis=-1).mean() > 0.4
    gaps = np.linalg.norm(p[:, :, None] - p[:, None], axis=-1) + 9 * np.eye(6)
    assert gaps[500:].min() > 0.15  # the source counts 3 m as a collision: at this scale 0.15 m


def test_a_radius_that_is_too_small_and_no_arena_are_noted():
    arena = {"arena": [[-3.0, -3.0], [3.0, 3.0]]}
    assert Vasarhelyi.check(graph((1, 2), []), {}, arena) == ([], [], {})
    assert Vasarhelyi.check(graph((1, 2), []), {}, {})[1] == [checks.NO_WALLS]
    assert Vasarhelyi.check(graph((1, 2), []), {}, {"length": 0.1, **arena})[1] == [checks.SHORT.format(8.53, 8.0)]
