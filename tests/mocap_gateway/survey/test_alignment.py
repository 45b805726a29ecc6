from math import cos, sin

import pytest
from flockwire_core.domain.pose import rotate
from flockwire_mocap.survey.alignment import AlignmentError, align, align_bodies
from hypothesis import assume, given
from hypothesis import strategies as st

number = st.floats(-5.0, 5.0)
places = st.lists(st.tuples(number, number, number), min_size=3, max_size=6)
PLANE = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, -2.0, 0.0)]


def moved(q, offset, points):
    return [tuple(a + b for a, b in zip(rotate(q, p), offset, strict=True)) for p in points]


def about(axis, angle):
    length = sum(c * c for c in axis) ** 0.5
    return (*(sin(angle / 2.0) * c / length for c in axis), cos(angle / 2.0))


@given(places, st.tuples(number, number, number), st.floats(-3.0, 3.0), st.tuples(number, number, number))
def test_a_motion_is_found_again(points, axis, angle, offset):
    assume(sum(c * c for c in axis) > 0.01)
    turned = moved(about(axis, angle), offset, points)
    try:
        found = align(points, turned)
    except AlignmentError:
        return
    assert max(found.residuals) < 1e-6
    assert moved(found.rotation, found.offset, points) == [pytest.approx(place, abs=1e-6) for place in turned]


def test_places_on_the_floor_are_enough_and_the_turn_is_not_a_mirror():
    q = about((0.0, 0.0, 1.0), 0.7)
    found = align(PLANE, moved(q, (1.0, -2.0, 0.1), PLANE))
    assert found.rotation == pytest.approx(q, abs=1e-9)
    assert found.offset == pytest.approx((1.0, -2.0, 0.1), abs=1e-9)


def test_a_body_that_is_elsewhere_shows_in_the_residuals():
    wrong = [*PLANE[:3], (-1.0, -1.5, 0.0)]
    assert max(align(wrong, PLANE).residuals) > 0.1


@pytest.mark.parametrize(
    ("points", "said"), [(PLANE[:2], "at least three"), ([(float(k), 1.0, 0.0) for k in range(4)], "on a line")]
)
def test_what_does_not_determine_it_is_refused(points, said):
    with pytest.raises(AlignmentError, match=said):
        align(points, points)


def test_bodies_are_aligned_by_their_names_and_one_that_is_not_seen_is_named():
    known = dict(zip("abcd", PLANE, strict=True))
    seen = {
        "other": (9.0, 9.0, 9.0),
        **dict(zip("dcba", moved(about((0.0, 0.0, 1.0), 0.7), (1.0, 0.0, 0.0), PLANE[::-1]), strict=True)),
    }
    found = align_bodies(seen, known)
    assert max(found.residuals) < 1e-9
    assert not found.doubtful
    with pytest.raises(AlignmentError, match="does not see b; it sees other, d, c, a"):
        align_bodies({name: place for name, place in seen.items() if name != "b"}, known)


def test_two_bodies_exchanged_are_doubtful():
    a, b, *others = PLANE
    assert align([b, a, *others], PLANE).doubtful
