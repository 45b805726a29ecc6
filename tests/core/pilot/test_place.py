"""The place that a drone keeps outside the formation."""

from math import hypot

import pytest
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.place import Place, climb, keep_place
from flockwire_core.wire.phase import Phase
from hypothesis import given
from hypothesis import strategies as st

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
