import numpy as np
import pytest
from flockwire_core.law import Observation, Sense
from flockwire_laws.flocking import Flocking
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, graph, place, settings, sight

STATE = Sense.POSITION | Sense.VELOCITY
PAPER = {"scale": 1.0, "distance": 7.0, "eps": 0.1, "a": 5.0, "b": 4.0, "c1": 0.2, "c2": 0.9}


@tries(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_command_is_the_equation(seed):
    draw = np.random.default_rng(seed)
    q, p = draw.uniform(-5, 5, (5, 3)), draw.normal(size=(5, 3))
    eps, a, b, h, d, r = 0.1, 5.0, 4.0, 0.2, 7.0, 8.4

    def sigma(z):
        return (np.sqrt(1 + eps * z @ z) - 1) / eps

    def bump(z):
        return np.select([z < h, z < 1], [1.0, (1 + np.cos(np.pi * (z - h) / (1 - h))) / 2], 0.0)

    rs, ds, c = sigma(np.array([r])), sigma(np.array([d])), abs(a - b) / np.sqrt(4 * a * b)
    u = -0.2 * (q[0] - (1.0, 2.0, 3.0)) - 0.9 * p[0]
    for j in range(1, 5):
        z = sigma(q[j] - q[0])
        shifted = z - ds + c
        phi = ((a + b) * shifted / np.sqrt(1 + shifted**2) + a - b) / 2
        u = (
            u
            + bump(z / rs) * phi * (q[j] - q[0]) / np.sqrt(1 + eps * np.sum((q[j] - q[0]) ** 2))
            + bump(z / rs) * (p[j] - p[0])
        )
    seen = [sight(STATE, -1, 0.0, False, q[j] - q[0], p[j] - p[0]) for j in range(1, 5)]
    observation = Observation(position=tuple(q[0]), velocity=tuple(p[0]), around=seen, place=place({1: np.zeros(3)}, 1))
    found = Flocking(settings(**PAPER, target=(1.0, 2.0, 3.0))).step(observation).command
    assert found == pytest.approx(u, abs=1e-5)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_centre_obeys_its_own_equation_and_velocities_meet(lag):
    draw = np.random.default_rng(5)
    q = draw.uniform(-1.5, 1.5, (8, 3)) * (1, 1, 0)
    v = draw.normal(size=(8, 3)) * (0.2, 0.2, 0)
    flight = Flight(Flocking, dict(enumerate(q, 1)), [], parameters={"target": (1.0, 0.0, 0.0)},
                    velocities=dict(enumerate(v, 1)), lag=lag)  # fmt: skip
    centre = flight.fly(15.0, lambda one: one.array.mean(axis=0))
    x, s = q.mean(axis=0) - (1.0, 0, 0), v.mean(axis=0)
    expected = [x]
    for _ in range(1500):
        s = s + 0.01 * (-0.2 * x - 0.9 * s)
        x = x + 0.01 * s
        expected.append(x)
    assert centre == pytest.approx(np.add(expected, (1.0, 0, 0)), abs=1e-3)
    assert max(np.linalg.norm(one) for one in flight.v.values()) < 0.02
    distances = np.linalg.norm(flight.array[:, None] - flight.array, axis=-1) + 9 * np.eye(8)
    assert 0.6 < distances.min(axis=0).mean() < 1.1


def test_neighbour_at_the_edge_of_the_radius_changes_nothing():
    law, site = Flocking(settings()), place({1: np.zeros(3)}, 1)

    def command(x):
        seen = [sight(STATE, -1, 0.0, False, np.array([x, 0.0, 0.0]), np.ones(3))]
        return np.array(
            law.step(Observation(position=(0.0,) * 3, velocity=(0.0,) * 3, around=seen, place=site)).command
        )

    assert np.abs(command(1.2 - 1e-6) - command(1.2 + 1e-6)).max() < 1e-6


def test_check_refuses_a_distance_beyond_the_radius():
    assert Flocking.check(graph((1,), []), {}, {"scale": 1.1})[0]
    assert not Flocking.check(graph((1,), []), {}, PAPER)[0]
