"""States and graphs without an answer: places or drones that coincide, one drone alone, rounds that diverge."""

import numpy as np
import pytest
from flockwire_core.domain.vector import ZERO
from flockwire_core.law import STATE, Observation, Sense
from flockwire_core.wire.sighting import sensed
from flockwire_laws.affine import AtRest
from flockwire_laws.aggregative import Aggregative
from flockwire_laws.barrier import Barrier
from flockwire_laws.barrier_first_order import FirstOrder
from flockwire_laws.bearing import Bearing
from flockwire_laws.consensus import Consensus
from flockwire_laws.event_triggered import EventTriggered, StateTriggered
from flockwire_laws.manoeuvre import Manoeuvre
from flockwire_laws.rigid import Rigid
from flockwire_laws.second_order import Relative
from flockwire_laws.spectrum import NO_TREE
from law_flights import both, graph, place, settings

APART = {1: ZERO, 2: (1.0, 0.0, 0.0)}
TOGETHER = {1: ZERO, 2: ZERO}


@pytest.mark.parametrize(
    ("law", "senses", "places", "position"),
    [
        (Bearing, Sense.BEARING, APART, ZERO),
        (Bearing, Sense.BEARING, TOGETHER, (1.0, 0.0, 0.0)),
        (Manoeuvre, STATE, TOGETHER, (1.0, 0.0, 0.0)),
    ],
)
def test_who_or_whose_place_is_where_the_own_one_is_has_no_bearing(law, senses, places, position):
    seen = sensed(senses, 2, position, ZERO, weight=1.0)
    decision = law(settings()).step(Observation(place=place(places, 1, (2,)), neighbours=[seen]))
    assert np.array_equal(decision.command, ZERO)


@pytest.mark.parametrize("law", [Barrier, FirstOrder])
@pytest.mark.parametrize("position", [ZERO, (0.0, 0.0, 0.4)])
def test_a_barrier_decides_at_whoever_is_at_the_same_x_and_y(law, position):
    around = [sensed(STATE, -1, position, ZERO)]
    seen = Observation(place=place(APART, 1), position=(0.5, 0.0, 0.0), velocity=ZERO, around=around)
    assert np.all(np.abs(law(settings()).step(seen).command) <= 1.0)


def test_stresses_without_a_sum_command_all_the_same():
    seen = [
        sensed(Sense.POSITION, 2, (1.0, 0.0, 0.0), ZERO, weight=1.0),
        sensed(Sense.POSITION, 3, (0.0, 1.0, 0.0), ZERO, weight=-1.0),
    ]
    decision = AtRest(settings(gain=1.0)).step(Observation(place=place(APART, 1), neighbours=seen))
    assert np.allclose(decision.command, (1.0, -1.0, 0.0))
    assert decision.error is None


@pytest.mark.parametrize("law", [Consensus, Relative, EventTriggered, Rigid])
def test_a_drone_alone_is_refused_in_one_line(law):
    (problem,) = law.check(graph([1], []), {1: ZERO}, {})[0]
    assert "add" in problem


def test_places_that_coincide_are_named():
    assert Bearing.check(graph([1, 2], both([(1, 2)])), TOGETHER, {})[0] == [
        "formation: the places of drones 1 and 2 coincide, and have no bearing: move one"
    ]


@pytest.mark.parametrize(("alpha", "diverges"), [(0.05, False), (0.3, True), (0.5, True)])
def test_rounds_of_too_large_steps_are_refused(alpha, diverges):
    ring = graph(range(1, 7), both([(i, i % 6 + 1) for i in range(1, 7)], 1.0 / 3.0))
    problems, _, rates = Aggregative.check(ring, {}, {"alpha": alpha})
    assert [f"alpha = {alpha:g}: a round has the spectral radius" in one for one in problems] == [True] * diverges
    assert bool(rates) is not diverges


@pytest.mark.parametrize(
    ("parameters", "needed"),
    [
        ({}, None),
        ({"alpha": 0.05}, None),
        ({"speed": 2.0}, None),
        ({"speed": 5.0, "gamma": 0.01, "alpha": 1000.0}, "4.93 m around"),
    ],
)
def test_the_radius_of_the_barrier_of_first_order_is_its_own(parameters, needed):
    problems = FirstOrder.check(graph([1, 2], both([(1, 2)])), APART, parameters)[0]
    assert [needed in one for one in problems] == ([True] if needed else [])


@pytest.mark.parametrize("sigma", [1.0, 1.5])
def test_a_sigma_beyond_its_theorem_is_refused(sigma):
    (problem,) = StateTriggered.check(graph([1, 2], both([(1, 2)])), APART, {"sigma": sigma})[0]
    assert problem == f"control.parameters.sigma = {sigma:g}: must be below 1"
    with pytest.raises(ValueError, match="sigma"):
        StateTriggered.check(graph([1, 2], both([(1, 2)])), APART, {"sigma": 0.0})


def test_two_drones_without_an_edge_have_no_spanning_tree():
    assert Consensus.check(graph([1, 2], []), APART, {})[0] == [NO_TREE]
