import numpy as np
import pytest
from flockwire_core.law import Heard, Observation, Place, Sense
from flockwire_laws.relative import Acceleration
from flockwire_laws.second_order import Relative, SecondOrder
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, rate, settings, sight

STATE = Sense.POSITION | Sense.VELOCITY
RING = [(i % 6 + 1, (i + 1) % 6 + 1, 1.0) for i in range(6)]  # directed
DEEP = [(0, 1, 1.0), (1, 2, 1.0), (2, 3, 2.0), (1, 3, 1.0), (3, 4, 1.0)]


class Turning:
    """Places that turn round a vertical axis at `rate` rad/s."""

    def __init__(self, places, rate):
        self.places, self.rate = places, rate

    def derivative(self, rank, t, order):
        x, y, z = self.places[rank]
        c = self.rate**order * (x + 1j * y) * np.exp(1j * (self.rate * t + order * np.pi / 2))
        return np.array([c.real, c.imag, 0.0 if order else z])

    def offset(self, rank, t):
        return tuple(self.derivative(rank, t, 0))

    def offset_rate(self, rank, t):
        return tuple(self.derivative(rank, t, 1))


@tries(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_commands_are_the_equations(seed):
    draw = np.random.default_rng(seed)
    p, v, a, h = draw.normal(size=(4, 4, 3))
    shape, t = Turning(h, draw.uniform(-3, 3)), draw.uniform(0, 30)
    h, dh, ddh = np.array([[shape.derivative(j, t, order) for j in range(4)] for order in range(3)])
    w = draw.uniform(0.2, 2.0, 4)
    seen = [sight(STATE, j + 1, w[j], False, p[j] - p[0], v[j] - v[0]) for j in (1, 2, 3)]
    heard = [Heard(j + 1, w[j], False, 0, 1, Acceleration(tuple(a[j]))) for j in (1, 2, 3)]
    observation = Observation(t=t, place=Place(shape, 0, 0, {2: 1, 3: 2, 4: 3}), neighbours=seen, heard=heard)
    z, dz = p - h, v - dh
    terms = np.array([w[j] * (a[j] - ddh[j] - 1.5 * (z[0] - z[j]) - 2.2 * (dz[0] - dz[j])) for j in (1, 2, 3)])
    given_, expected = settings(kp=1.5, kv=2.2), ddh[0] + terms.sum(axis=0) / w[1:].sum()
    assert SecondOrder(given_).step(observation).command == pytest.approx(expected, abs=1e-5)
    bare = np.array([-w[j] * (1.5 * (z[0] - z[j]) + 2.2 * (v[0] - v[j])) for j in (1, 2, 3)]).sum(axis=0)
    assert Relative(given_).step(observation).command == pytest.approx(bare, abs=1e-5)


def circling(t):
    c, s = 1.2 * np.cos(0.5 * t), 1.2 * np.sin(0.5 * t)
    return (c, s, 0.0), (-0.5 * s, 0.5 * c, 0.0), (-0.25 * c, -0.25 * s, 0.0)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_fed_followers_lose_nothing_behind_a_circling_leader(lag):
    flight = Flight(
        SecondOrder, {i: (1.2 - i, 0.5 * i, 0.0) for i in range(1, 5)}, DEEP, leaders={0: circling}, lag=lag
    )
    errors = flight.fly(30.0, lambda one: np.linalg.norm(one.array - circling(one.t)[0], axis=1))
    assert errors[0].min() > 0.4
    assert errors[-1].max() < 0.010  # 3.6 mm at data of 10 ms; 6 mm with the lag compensated


def test_fed_error_falls_as_its_equation_on_any_graph():
    flight = Flight(SecondOrder, {i: (float(i), 0.0, 0.0) for i in range(1, 5)}, DEEP,
                    leaders={0: lambda t: ((0.0,) * 3,) * 3})  # fmt: skip
    errors = flight.fly(12.0, lambda one: np.abs(one.array[0, 0]))
    assert rate(errors, 0.01, 5.0, 11.0) == pytest.approx(
        SecondOrder.check(flight.graph, {}, {})[2]["slowest"], rel=0.05
    )


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_balanced_centroid_coasts_on_a_straight_line(lag):
    draw = np.random.default_rng(3)
    v = draw.normal(size=(6, 3)) * 0.3
    flight = Flight(
        Relative, dict(enumerate(draw.normal(size=(6, 3)), 1)), RING, velocities=dict(enumerate(v, 1)), lag=lag
    )
    centre = flight.fly(10.0, lambda one: one.array.mean(axis=0))
    assert centre == pytest.approx(centre[0] + np.outer(np.arange(1001) * 0.01, v.mean(axis=0)), abs=1e-3)
    assert np.ptp(flight.array, axis=0).max() < 0.3


@pytest.mark.parametrize(("gamma", "diverges"), [(1.15, True), (1.4, False)])
def test_directed_ring_needs_its_damping(gamma, diverges):
    draw, parameters = np.random.default_rng(4), {"kp": 1.0, "kv": gamma}
    flight = Flight(Relative, dict(enumerate(draw.normal(size=(6, 3)), 1)), RING, parameters=parameters, dt=0.005)
    problems, _, rates = Relative.check(flight.graph, {}, parameters)
    assert bool(problems) == diverges
    spread = flight.fly(36.0, lambda one: np.linalg.norm(one.array - one.array.mean(axis=0)))
    trend = np.polyfit(np.arange(3600, 7201) * 0.005, np.log(spread[3600:]), 1)[0]
    assert trend == pytest.approx(-rates["slowest"], rel=0.15, abs=0.003)
    assert (trend > 0) == diverges


def test_relative_chain_trails_an_accelerating_leader_by_its_depth():
    leader = {0: lambda t: ((0.01 * t * t, 0.0, 0.0), (0.02 * t, 0.0, 0.0), (0.02, 0.0, 0.0))}
    flight = Flight(
        Relative, dict.fromkeys((1, 2, 3), (0.0, 0.0, 0.0)), [(0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0)], leaders=leader
    )
    flight.fly(40.0)
    assert 0.01 * flight.t**2 - flight.array[:, 0] == pytest.approx([0.02, 0.04, 0.06], abs=1e-3)
