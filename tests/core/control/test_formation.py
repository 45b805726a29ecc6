from math import cos, pi, sin

import pytest
from flockwire_core.control.formation import Circle, grid, line, polygon
from flockwire_core.domain.vector import distance, norm, scale, subtract
from hypothesis import given
from hypothesis import strategies as st

lengths, rates, counts = st.floats(0.1, 10.0), st.floats(-2.0, 2.0), st.integers(1, 40)
formations = st.one_of(
    st.builds(Circle, counts, lengths, rates),
    st.builds(line, counts, lengths, st.floats(-pi, pi), rates),
    st.builds(grid, counts, lengths, st.integers(1, 12), rates),
    st.builds(polygon, counts, st.integers(3, 8), lengths, rates),
)


@given(formations, st.integers(0, 39), st.floats(0.0, 100.0))
def test_the_offset_rate_is_the_derivative_of_the_offset(formation, index, t):
    index %= formation.count
    step = 1e-5
    slope = scale(subtract(formation.offset(index, t + step), formation.offset(index, t - step)), 0.5 / step)
    assert formation.offset_rate(index, t) == pytest.approx(slope, abs=1e-5)


@given(formations)
def test_every_drone_has_its_own_place_and_the_leader_keeps_its_own(formation):
    places = [(0.0, 0.0, 0.0), *(formation.offset(index, 3.0) for index in range(formation.count))]
    for rank, place in enumerate(places):
        assert all(distance(place, other) > 1e-3 for other in places[:rank])


def test_circle_is_the_papers():
    circle = Circle(count=4, radius=2.0, rate=1.0)
    for i in range(1, 5):
        angle = 0.7 + (i - 1) * pi / 2
        assert circle.offset(i - 1, 0.7) == pytest.approx((2 * sin(angle), 2 * cos(angle), 0.0))


def test_line_alternates_round_the_leader():
    shape = line(count=5, spacing=0.5, heading=pi / 2, rate=0.0)
    assert [shape.offset(index, 9.0)[1] for index in range(5)] == pytest.approx([0.5, -0.5, 1.0, -1.0, 1.5])


def test_grid_surrounds_the_leader_from_front_left():
    shape = grid(count=8, spacing=1.0, columns=3, rate=0.0)
    assert [shape.offset(index, 0.0)[:2] for index in range(8)] == [
        (1.0, 1.0), (1.0, 0.0), (1.0, -1.0), (0.0, 1.0), (0.0, -1.0), (-1.0, 1.0), (-1.0, 0.0), (-1.0, -1.0),
    ]  # fmt: skip


def test_a_grid_of_one_row_is_centred_on_the_leader():
    shape = grid(count=4, spacing=1.0, columns=100, rate=0.0)
    assert [shape.offset(index, 0.0)[1] for index in range(4)] == [2.0, 1.0, -1.0, -2.0]


def test_polygon_puts_as_many_followers_as_sides_on_the_corners_and_twice_as_many_on_edge_centres_too():
    assert all(norm(polygon(5, 5, 2.0, 0.1).offset(index, 4.0)) == pytest.approx(2.0) for index in range(5))
    square = polygon(8, 4, 1.0, 0.0)
    assert square.offset(1, 0.0) == pytest.approx((0.5, 0.5, 0.0))
    assert square.offset(2, 0.0) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_the_kinds_that_turn_do_so_counter_clockwise_for_a_positive_rate():
    for formation in (line(4, 1.0, 0.0, pi), grid(4, 1.0, 3, pi), polygon(4, 4, 1.0, pi)):
        (x, y, _), (later_x, later_y, _) = formation.offset(0, 0.0), formation.offset(0, 0.5)
        assert (later_x, later_y) == pytest.approx((-y, x), abs=1e-12)
