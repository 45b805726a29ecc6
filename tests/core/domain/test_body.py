from math import hypot

import pytest
from flockwire_core.domain.body import to_axis, to_surface
from hypothesis import given
from hypothesis import strategies as st

coordinates = st.floats(-10.0, 10.0)
vectors = st.tuples(coordinates, coordinates, coordinates)


@given(vectors, vectors)
def test_an_endless_axis_is_nearest_at_ones_own_height(position, center):
    x, y, z = to_axis(position, center, None)
    assert (x, y) == (center[0] - position[0], center[1] - position[1])
    assert z == 0.0


@pytest.mark.parametrize(("z", "expected"), [(0.5, 0.0), (2.0, 0.0), (3.0, -1.0)])
def test_above_a_cylinder_its_top_is_nearest(z, expected):
    assert to_axis((1.0, 1.0, z), (2.0, 1.0, 0.0), 2.0) == (1.0, 0.0, expected)


@given(vectors.filter(lambda v: hypot(*v) > 0.01), st.floats(0.0, 3.0))
def test_the_surface_lies_on_the_way_to_the_axis(relative, radius):
    surface, distance = to_surface(relative, radius), hypot(*relative)
    assert hypot(*surface) == pytest.approx(max(distance - radius, 0.001))
    assert sum(a * b for a, b in zip(surface, relative, strict=True)) > 0.0


def test_on_the_axis_there_is_no_direction():
    assert to_surface((0.0, 0.0, 0.0), 1.0) == (0.0, 0.0, 0.0)
