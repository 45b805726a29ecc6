"""The test of a body that may be another drone's."""

from math import cos, pi, sin

import pytest
from flockwire.control.airframe.response import Response
from hypothesis import given
from hypothesis import strategies as st

SPEED = 1.5  # m/s
STEP = 0.1  # s


def found(motion, command, *, floor=lambda _: 0.0, wind=0.0, seconds=10.0):
    """Return after how many s the body is found apart, None if it is not; `motion` is y' (m/s) at a command."""
    response, y, travelled = Response(SPEED, wind), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    for k in range(round(seconds / STEP)):
        t = k * STEP
        if response.update(y, travelled, floor(t), t):
            return t
        u = command(t)
        v = motion(u, t)
        y = tuple(p + STEP * w for p, w in zip(y, v, strict=True))
        travelled = tuple(p + STEP * w for p, w in zip(travelled, u, strict=True))
    return None


def away(_):
    return (SPEED, 0.0, 0.0)


def circling(t):
    return (SPEED * cos(t), SPEED * sin(t), 0.0)


def test_two_that_fly_away_from_one_another_by_each_others_poses_are_found_at_once():
    assert found(lambda u, _: (-u[0], -u[1], 0.0), away) == pytest.approx(0.3)


def test_a_body_that_hovers_while_its_drone_flies_is_found_within_the_window():
    assert found(lambda _, __: (0.0, 0.0, 0.0), away) == pytest.approx(0.9)


@given(st.floats(-pi, pi), st.floats(0.0, 0.5), st.floats(0.8, 1.2))
def test_a_drones_own_body_is_not_taken_for_anothers_in_wind_and_with_a_wrong_gain(towards, share, gain):
    wind = (share * SPEED * cos(towards), share * SPEED * sin(towards))
    for command in (away, circling):
        assert found(lambda u, _: (gain * u[0] + wind[0], gain * u[1] + wind[1], 0.0), command) is None


def test_a_wind_that_is_to_be_compensated_is_allowed():
    def blown(u, _):
        return (u[0] - 1.4, u[1], 0.0)

    def against(_):
        return (1.4, 0.0, 0.0)

    assert found(blown, against, wind=1.4) is None
    assert found(blown, against) is not None


def test_a_pose_that_comes_down_alone_is_anothers_and_a_box_below_is_none():
    still = (lambda u, _: u), (lambda _: (0.0, 0.0, 0.0))
    assert found(*still, floor=lambda t: -0.7 * max(t - 3.0, 0.0)) == pytest.approx(4.2)
    assert found(*still, floor=lambda t: -0.6 if t > 3.0 else 0.0) is None


def test_what_was_seen_before_a_reset_is_not_compared():
    response = Response(SPEED, 0.0)
    response.update((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0, 0.0)
    response.reset()
    assert not response.update((5.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0, 0.1)
    assert response.path == 0.0
