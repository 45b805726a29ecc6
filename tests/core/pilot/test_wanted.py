"""The place that a drone keeps outside the formation; accelerations reach an airframe with lag as they are wanted."""

from math import exp, hypot

import pytest
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.wanted import AccelerationInput, Place, climb, keep_place
from flockwire_core.wire.phase import Phase
from hypothesis import given
from hypothesis import strategies as st

PERIOD = 0.01  # s
coordinates = st.floats(-5.0, 5.0)
vectors = st.tuples(coordinates, coordinates, coordinates)


@given(vectors, vectors, st.floats(0.1, 2.0))
def test_keeping_a_place_leads_there_within_the_speed(position, place, speed):
    velocity = keep_place(position, place, speed)
    assert hypot(*velocity) <= speed * (1 + 1e-12)
    assert sum(v * (b - a) for v, a, b in zip(velocity, position, place, strict=True)) >= 0.0


@given(vectors, vectors, st.sampled_from([0.7, -0.7]))
def test_a_climb_is_straight_above_its_place(position, place, vertical):
    x, y, z = climb(position, place, vertical)
    assert z == vertical
    assert hypot(x, y) <= 0.7 * (1 + 1e-12)
    assert climb((place[0], place[1], 9.0), place, vertical) == (0.0, 0.0, vertical)


@pytest.mark.parametrize(("below", "sinks"), [(0.2, False), (1.0, True)])
def test_it_descends_only_where_nobody_is_below(make_swarm, below, sinks):
    parameters = pilot_parameters(make_swarm({"control.law": "extended"}), 1)
    body = Body(BodyKind.DRONE, (below, 0.0, -1.0), 0.0)
    x, _, z = Place(parameters).velocity(Phase.LANDING, (0.0, 0.0, 1.0), (body,))
    assert (x < 0.0, z) == (not sinks, -parameters.limits.vertical_speed if sinks else 0.0)


def flown(lag, wanted, sent_of=lambda command: command):
    """Fly a first-order airframe of lag `lag` for a second; returns its velocity along x."""
    given, v, sent = AccelerationInput(lag, PERIOD), 0.0, (0.0, 0.0, 0.0)
    for k in range(100):
        given.follow(sent, PERIOD if k else 0.0)
        sent = sent_of(given.velocity((wanted, 0.0, 0.0)))
        v = sent[0] + (v - sent[0]) * (exp(-PERIOD / lag) if lag else 0.0)
    return v


@pytest.mark.parametrize("lag", [0.0, 0.02, 0.1, 0.3])
def test_the_airframe_accelerates_as_wanted_whatever_its_lag(lag):
    assert flown(lag, 0.5) == pytest.approx(0.5, abs=1e-9)


def test_where_a_filter_limits_the_command_it_goes_on_from_what_the_body_reached():
    slow = lambda command: (min(command[0], 0.2), 0.0, 0.0)  # noqa: E731
    assert flown(0.1, 0.5, slow) == pytest.approx(0.2, abs=0.02)
