"""The room that no drone may leave: a box, or a polygon of any form."""

from math import cos, hypot, inf, pi, sin

import pytest
from flockwire_core.control.barrier import Approach
from flockwire_core.control.fence import Room
from flockwire_core.control.plane_polygon import clearance, contains, crossing
from flockwire_core.control.safety_filter import nearest_velocity
from flockwire_core.domain.vector import ZERO
from hypothesis import given
from hypothesis import strategies as st

LOW, HIGH = (-1.0, -2.0, 0.0), (1.0, 2.0, 3.0)
coordinates = st.floats(-5.0, 5.0)
vectors = st.tuples(coordinates, coordinates, coordinates)
SQUARE = ((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0))
ELL = ((0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0))  # (2, 2) is outside
STAR = tuple(
    ((3.0 if k % 2 == 0 else 1.2) * cos(k * pi / 5), (3.0 if k % 2 == 0 else 1.2) * sin(k * pi / 5)) for k in range(10)
)
BOX = ((-9.0, -9.0, 0.0), (9.0, 9.0, 3.0))


@given(vectors, vectors)
def test_the_fence_removes_only_outward_velocity(velocity, position):
    for v, kept, p, low, high in zip(
        velocity, Room(LOW, HIGH).inwards(velocity, position), position, LOW, HIGH, strict=True
    ):
        outward = (p <= low and v < 0.0) or (p >= high and v > 0.0)
        assert kept == (0.0 if outward else v)


@given(vectors)
def test_outside_is_the_largest_excess_over_the_axes(position):
    beyond = Room(LOW, HIGH).outside(position)
    inside = all(low <= p <= high for p, low, high in zip(position, LOW, HIGH, strict=True))
    assert (beyond == 0.0) == inside
    assert Room(LOW, HIGH).outside((1.0, 2.5, 4.0)) == 1.0


@pytest.mark.parametrize("corners", [ELL, ELL[::-1], STAR, STAR[::-1], SQUARE])
@given(st.tuples(coordinates, coordinates))
def test_the_clearance_is_the_distance_to_the_boundary_and_grows_inwards(corners, point):
    distance, (nx, ny) = clearance(corners, point)
    assert hypot(nx, ny) == pytest.approx(1.0)
    if abs(distance) > 1e-6:
        assert contains(corners, point) == (distance > 0.0)
        step = min(1e-3, 0.5 * abs(distance)) * (-1.0 if distance > 0.0 else 1.0)  # towards the boundary
        moved = clearance(corners, (point[0] + step * nx, point[1] + step * ny))[0]
        assert moved == pytest.approx(distance + step, abs=1e-9)


def test_of_a_polygon_that_is_not_convex_the_nearest_edge_counts():
    room = Room(*BOX, ELL)
    assert room.outside((0.5, 3.0, 1.0)) == room.outside((3.0, 0.5, 1.0)) == 0.0
    assert room.outside((2.0, 2.0, 1.0)) == pytest.approx(1.0)
    assert room.outside((5.0, 0.5, 1.0)) == pytest.approx(1.0)
    assert room.outside((5.0, 0.5, 5.5)) == pytest.approx(2.5)
    assert room.inwards((1.0, 2.0, 0.5), (1.2, 3.0, 1.0)) == pytest.approx((0.0, 2.0, 0.5))  # back is to -X
    assert room.inwards((-1.0, 2.0, 0.5), (1.2, 3.0, 1.0)) == (-1.0, 2.0, 0.5)
    assert room.inwards((1.0, 2.0, 0.5), (0.5, 3.0, 1.0)) == (1.0, 2.0, 0.5)


def test_a_square_polygon_is_the_box():
    room, box = Room(*BOX, SQUARE), Room((-2.0, -2.0, 0.0), (2.0, 2.0, 3.0))
    approach = Approach(ZERO, 2.0, 5.0, 10.0)
    for k in range(400):
        angle, radius = 0.7 * k, 0.01 * k
        place, stopping = (radius * cos(angle), radius * sin(angle), 1.0), (1.05 * radius * cos(angle), 0.0, 1.2)
        if max(map(abs, (*place[:2], *stopping[:2]))) < 1.99:
            spaces = [sorted(shape.half_spaces(place, stopping, 0.0, approach)) for shape in (room, box)]
            assert [pytest.approx(space, abs=1e-9) for space in spaces[1]] == spaces[0]


TEN = Room((0.0, 0.0, 0.0), (10.0, 10.0, 10.0))
STANDING = Approach(ZERO, 3.0, 5.0, inf)


def test_a_box_leaves_out_the_faces_that_are_far():
    assert TEN.half_spaces((5.0, 5.0, 5.0), (5.0, 5.0, 5.0), 0.0, STANDING) == []
    (space,) = TEN.half_spaces((5.0, 5.0, 5.0), (9.9, 5.0, 5.0), 0.0, STANDING)
    assert space == pytest.approx((-1.0, 0.0, 0.0, -0.5))
    (space,) = TEN.half_spaces((-0.2, 5.0, 5.0), (5.0, 5.0, 5.0), 0.0, STANDING)
    assert space == pytest.approx((1.0, 0.0, 0.0, 1.0))  # outside: come back


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("place", "normal"), [(0.1, 1.0), (9.9, -1.0)], ids=["low", "high"])
def test_each_face_is_a_wall(axis, place, normal):
    position = tuple(place if k == axis else 5.0 for k in range(3))
    (space,) = TEN.half_spaces(position, position, 0.0, STANDING)
    assert space == pytest.approx((*(normal if k == axis else 0.0 for k in range(3)), -0.5))


@pytest.mark.parametrize("corners", [ELL, ELL[::-1], STAR])
@pytest.mark.parametrize("wanted", [(3.0, 0.1), (0.2, -2.0), (-1.5, 2.5), (2.0, 2.0)])
def test_a_drone_that_obeys_stays_inside(corners, wanted):
    """At 100 Hz, with an airframe that answers at once."""
    room, place, approach = Room(*BOX, corners), (0.5, 0.5, 1.0), Approach(ZERO, 3.0, 5.0, inf)
    for k in range(300):
        goal = (wanted[0] * cos(0.02 * k), wanted[1], 0.0)
        spaces = room.half_spaces(place, place, 0.0, approach)
        velocity, _ = nearest_velocity(goal, spaces, 3.0)
        place = tuple(p + 0.01 * v for p, v in zip(place, velocity, strict=True))
        assert room.outside(place) < 1e-6


@pytest.mark.parametrize("start", [(2.0, 2.0), (5.0, 0.5), (-1.0, -1.0), (1.3, 3.9)])
def test_from_outside_it_comes_back(start):
    room, place, approach = Room(*BOX, ELL), (*start, 1.0), Approach(ZERO, 3.0, 5.0, 10.0)
    for _ in range(300):
        velocity, _ = nearest_velocity((0.0, 0.0, 0.0), room.half_spaces(place, place, 0.0, approach), 3.0)
        place = tuple(p + 0.01 * v for p, v in zip(place, velocity, strict=True))
    assert room.outside(place) < 0.01


@pytest.mark.parametrize(
    ("corners", "found"),
    [
        (SQUARE, None),
        (ELL, None),
        (STAR, None),
        (((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)), (0, 2)),  # a bow tie
        (((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.0), (0.0, 4.0)), (0, 2)),  # a corner on an edge
        (((0.0, 0.0), (2.0, 0.0), (1.0, 0.0), (1.0, 2.0)), (0, 1)),  # an edge that leads back
        (((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)), (0, 2)),  # no room at all
    ],
)
def test_a_polygon_that_crosses_or_touches_itself_is_found(corners, found):
    assert crossing(corners) == found
