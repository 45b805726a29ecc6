"""The place that a drone keeps outside the formation."""

from math import hypot

from flockwire.pilot.place import climb, keep_place
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
