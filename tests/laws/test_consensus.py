import numpy as np
import pytest
from flockwire_core.law import Observation, Sense
from flockwire_laws.consensus import Consensus
from flockwire_laws.spectrum import NO_TREE
from hypothesis import given
from hypothesis import settings as tries
from hypothesis import strategies as st
from law_flights import Flight, both, graph, place, rate, settings, sight

RING = both([(1, 2), (2, 3), (3, 4), (4, 5), (5, 1)])
SIX = [(1, 2, 1.0), (2, 3, 1.0), (3, 1, 1.0), (3, 4, 2.0), (4, 5, 1.0)]  # directed, rooted at 1, 2, 3


@tries(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_command_is_the_equation(seed):
    draw = np.random.default_rng(seed)
    p, h, w = draw.normal(size=(4, 3)), draw.normal(size=(4, 3)), draw.uniform(0.2, 2.0, 4)
    seen = [sight(Sense.POSITION, j + 1, w[j], False, p[j] - p[0], np.zeros(3)) for j in (1, 2, 3)]
    site = place(dict(enumerate(h, 1)), 1, (2, 3, 4))
    found = Consensus(settings(gain=0.7)).step(Observation(place=site, neighbours=seen)).command
    z = p - h
    assert found == pytest.approx(-0.7 * (w[1:].sum() * z[0] - w[1:] @ z[1:]), abs=1e-5)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_ring_keeps_the_average_and_converges_at_lambda_2(lag):
    draw = np.random.default_rng(1)
    places = {i: (np.cos(1.2566 * i), np.sin(1.2566 * i), 0.0) for i in range(1, 6)}
    flight = Flight(Consensus, dict(enumerate(draw.normal(size=(5, 3)), 1)), RING, places, lag=lag)
    h = np.array(list(places.values()))
    z = flight.fly(8.0, lambda one: one.array - h)
    predicted = Consensus.check(flight.graph, places, {})[2]["slowest"]
    assert predicted == pytest.approx(2.0 - 2.0 * np.cos(2.0 * np.pi / 5))
    assert np.abs(z.mean(axis=1) - z[0].mean(axis=0)).max() < 1e-3
    errors = np.linalg.norm(z - z.mean(axis=1, keepdims=True), axis=(1, 2))
    # a lag turns lambda into (1 − sqrt(1 − 4 tau lambda)) / (2 tau)
    real = (1.0 - np.sqrt(1.0 - 4.0 * lag * predicted)) / (2.0 * lag) if lag else predicted
    assert rate(errors, 0.01, 2.0, 7.0) == pytest.approx(real, rel=0.05)


def test_directed_graph_agrees_on_the_roots_weighted_average():
    flight = Flight(Consensus, {i: (float(i * i), -i, 0.0) for i in range(1, 6)}, SIX)
    start = flight.array
    flight.fly(25.0)
    assert flight.array == pytest.approx(np.tile(start[:3].mean(axis=0), (5, 1)), abs=1e-3)


def test_chain_lags_behind_its_leader_by_its_depth():
    leader = {0: lambda t: ((0.2 * t, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.0, 0.0))}
    flight = Flight(Consensus, dict.fromkeys((1, 2, 3), (0.0, 1.0, 0.0)), [(0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0)],
                    leaders=leader, parameters={"gain": 2.0})  # fmt: skip
    flight.fly(15.0)
    assert 0.2 * flight.t - flight.array[:, 0] == pytest.approx([0.1, 0.2, 0.3], abs=3e-3)


def test_shifted_world_gives_the_same_commands():
    positions = {i: np.array([i, i * i, 1.0]) for i in range(1, 6)}
    one, other = (
        Flight(Consensus, {i: p + s for i, p in positions.items()}, RING) for s in (0.0, np.array([5, -3, 2]))
    )
    for flight in (one, other):
        flight.step()
    for i in positions:
        assert one.decisions[i].command == pytest.approx(other.decisions[i].command, abs=1e-9)


def test_check_refuses_a_graph_without_a_tree():
    assert Consensus.check(graph((1, 2, 3), [(1, 2, 1.0)]), {}, {})[0] == [NO_TREE]
    assert not Consensus.check(graph((1, 2), [(0, 1, 1.0), (1, 2, 1.0)]), {}, {})[0]
