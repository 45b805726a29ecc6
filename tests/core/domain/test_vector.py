import pytest
from flockwire_core.domain.vector import ZERO, add, distance, limit, norm, scale, subtract
from hypothesis import given
from hypothesis import strategies as st

coordinates = st.floats(-1e3, 1e3)
vectors = st.tuples(coordinates, coordinates, coordinates)


def test_arithmetic():
    assert add((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)) == (5.0, 7.0, 9.0)
    assert subtract((1.0, 2.0, 3.0), (4.0, 5.0, 7.0)) == (-3.0, -3.0, -4.0)
    assert scale((1.0, -2.0, 3.0), 2.0) == (2.0, -4.0, 6.0)
    assert norm((2.0, 3.0, 6.0)) == 7.0
    assert distance((1.0, 1.0, 1.0), (3.0, 4.0, 7.0)) == 7.0


@given(vectors, st.floats(0.0, 1e3))
def test_limit_keeps_the_direction_and_never_exceeds_the_maximum(vector, maximum):
    limited = limit(vector, maximum)
    assert norm(limited) <= maximum * (1 + 1e-12) + 1e-300
    assert scale(limited, norm(vector)) == pytest.approx(scale(vector, norm(limited)), abs=1e-6)


def test_limit_leaves_short_vectors_alone():
    assert limit((0.3, 0.4, 0.0), 0.5) == (0.3, 0.4, 0.0)
    assert limit(ZERO, 0.0) == ZERO
