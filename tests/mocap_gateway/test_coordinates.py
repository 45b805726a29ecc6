from math import cos, pi, sin, sqrt

import pytest
from flockwire_core.domain.pose import product, rotate
from flockwire_mocap.coordinates import Coordinates
from flockwire_mocap.tracking import ReportedBody, is_pose
from hypothesis import given
from hypothesis import strategies as st

number = st.floats(-10.0, 10.0)
vectors = st.tuples(number, number, number)
HALF = sqrt(0.5)


def about_z(angle):
    return (0.0, 0.0, sin(angle / 2.0), cos(angle / 2.0))


@st.composite
def rotations(draw):
    q = draw(st.tuples(number, number, number, number).filter(lambda q: sum(c * c for c in q) > 0.01))
    length = sqrt(sum(c * c for c in q))
    return tuple(c / length for c in q)


frames_of_reference = st.builds(
    Coordinates, st.sampled_from(["y", "z"]), st.sampled_from(["m", "mm"]), rotations(), vectors
)


def test_y_up_becomes_z_up():
    coordinates = Coordinates(up_axis="y")
    assert coordinates.position((1.0, 2.0, 3.0)) == (1.0, -3.0, 2.0)
    assert coordinates.orientation((0.1, 0.2, 0.3, 0.4)) == pytest.approx((0.1, -0.3, 0.2, 0.4))


def test_heading_about_the_tracker_s_up_axis_is_heading_on_the_field():
    turned = (0.0, HALF, 0.0, HALF)  # a quarter turn about y, which is up
    assert Coordinates(up_axis="y").orientation(turned) == pytest.approx(about_z(pi / 2))


def test_millimetres():
    assert Coordinates(unit="mm").position((1000.0, -2500.0, 1.0)) == pytest.approx((1.0, -2.5, 0.001))


def test_rotation_and_offset():
    field = Coordinates(rotation=about_z(pi / 2), offset=(10.0, 0.0, 1.0))
    assert field.position((1.0, 0.0, 0.0)) == pytest.approx((10.0, 1.0, 1.0))
    assert field.orientation((0.0, 0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, HALF, HALF))


@given(frames_of_reference, rotations(), vectors, vectors)
def test_a_point_of_a_body_lands_where_its_converted_pose_puts_it(coordinates, orientation, position, point):
    scale = 0.001 if coordinates.unit == "mm" else 1.0
    before = tuple(p + r for p, r in zip(position, rotate(orientation, point), strict=True))
    # the body's own axes turn with the tracker's: a point of it is converted by the up axis alone
    turned = Coordinates(coordinates.up_axis, coordinates.unit).position(point)
    q = coordinates.orientation(orientation)
    after = tuple(p + r for p, r in zip(coordinates.position(position), rotate(q, turned), strict=True))
    assert after == pytest.approx(coordinates.position(before), abs=1e-9 + 1e-9 / scale)


@given(rotations(), rotations(), vectors)
def test_the_product_rotates_by_the_second_then_by_the_first(a, b, v):
    assert rotate(product(a, b), v) == pytest.approx(rotate(a, rotate(b, v)), abs=1e-9)


def test_bodies_are_converted_and_keep_the_rest():
    body = ReportedBody(1, "one", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), tracked=False)
    assert Coordinates(up_axis="y").body(body) == body._replace(position=(1.0, -3.0, 2.0))


@given(rotations(), vectors, st.sampled_from(["y", "z"]), st.sampled_from(["m", "mm"]))
def test_a_body_on_the_field_comes_back_from_the_tracker(q, place, up_axis, unit):
    coordinates = Coordinates(up_axis, unit, q, (1.0, -2.0, 3.0))
    body = ReportedBody(1, "one", place, (0.6, 0.0, 0.0, 0.8), tracked=True)
    back = coordinates.body(coordinates.to_tracker(body))
    assert back.position == pytest.approx(place, abs=1e-9)
    assert back.orientation == pytest.approx(body.orientation, abs=1e-9)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_only_finite_poses_of_unit_quaternions_are_poses(value):
    assert is_pose((1.0, 2.0, 3.0), (0.0, 0.0, HALF, -HALF))
    assert not is_pose((1.0, value, 3.0), (0.0, 0.0, 0.0, 1.0))
    assert not is_pose((1.0, 2.0, 3.0), (value, 0.0, 0.0, 1.0))
    assert not is_pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 0.0))
