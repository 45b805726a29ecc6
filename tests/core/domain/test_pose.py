"""The heading of a body."""

from math import cos, pi, sin

import pytest
from flockwire_core.domain.pose import LEVEL, wrapped, yaw_of
from hypothesis import given
from hypothesis import strategies as st


@given(st.floats(-3.1, 3.1))
def test_a_turn_about_the_vertical_is_the_heading(angle):
    assert yaw_of((0.0, 0.0, sin(angle / 2.0), cos(angle / 2.0))) == pytest.approx(angle, abs=1e-9)
    assert yaw_of(LEVEL) == 0.0


@given(st.floats(-1.4, 1.4), st.sampled_from((0, 1)))
def test_a_body_that_tilts_keeps_its_heading(tilt, axis):
    turned = [0.0, 0.0, 0.0, cos(tilt / 2.0)]
    turned[axis] = sin(tilt / 2.0)
    assert yaw_of(tuple(turned)) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-50.0, 50.0))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle):
    assert -pi <= wrapped(angle) <= pi
    assert cos(wrapped(angle)) == pytest.approx(cos(angle), abs=1e-9)
    assert sin(wrapped(angle)) == pytest.approx(sin(angle), abs=1e-9)
