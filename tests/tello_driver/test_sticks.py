from math import cos, hypot, inf, nan, pi, sin

import pytest
from flockwire_tello.sticks import (
    CENTRED,
    FULL,
    Sticks,
    parse_sticks,
    stick_values,
    to_body,
    to_velocity,
    to_world,
)
from flockwire_tello.swarm_file import StickGains
from hypothesis import given
from hypothesis import strategies as st

GAINS = StickGains(right=0.01, forward=0.01, up=0.01, clockwise=pi / 180)
speeds = st.floats(-5.0, 5.0)
velocities = st.tuples(speeds, speeds, speeds)
gains = st.builds(StickGains, **dict.fromkeys(StickGains.model_fields, st.floats(0.003, 0.05)))


def to_sticks(velocity, yaw_rate, found):
    return Sticks(*map(round, stick_values(velocity, yaw_rate, found)))


@pytest.mark.parametrize(
    ("velocity", "yaw_rate", "command"),
    [
        ((0.5, 0.0, 0.0), 0.0, "rc 0 50 0 0"),
        ((0.0, 0.5, 0.0), 0.0, "rc -50 0 0 0"),
        ((0.0, 0.0, 0.5), 0.0, "rc 0 0 50 0"),
        ((0.0, 0.0, 0.0), pi / 6, "rc 0 0 0 -30"),
        ((2.0, 1.0, 0.0), 0.0, "rc -50 100 0 0"),
        ((0.0, 0.0, 0.0), -9.0, "rc 0 0 0 100"),
    ],
)
def test_the_signs_are_the_drone_s(velocity, yaw_rate, command):
    assert to_sticks(velocity, yaw_rate, GAINS).command == command


@given(velocities, speeds, gains)
def test_sticks_stay_in_range_and_keep_the_direction(velocity, yaw_rate, found):
    sticks = to_sticks(velocity, yaw_rate, found)
    assert all(abs(value) <= FULL for value in sticks)
    scale = max(
        1.0, *(abs(v / g) / FULL for v, g in zip(velocity, (found.forward, found.right, found.up), strict=True))
    )
    flown, _ = to_velocity(sticks, found)
    for got, wanted, gain in zip(flown, velocity, (found.forward, found.right, found.up), strict=True):
        assert got == pytest.approx(wanted / scale, abs=0.51 * gain)


@given(st.tuples(*[st.integers(-FULL, FULL)] * 4), gains)
def test_velocity_and_sticks_are_inverse(values, found):
    sticks = Sticks(*values)
    assert to_sticks(*to_velocity(sticks, found), found) == sticks
    assert parse_sticks(sticks.command) == sticks


@pytest.mark.parametrize("bad", [nan, inf])
def test_what_is_not_finite_is_rejected(bad):
    with pytest.raises(ValueError, match="must be finite"):
        to_sticks((0.0, bad, 0.0), 0.0, GAINS)


@given(velocities, st.floats(-10.0, 10.0))
def test_world_and_body_are_inverse(velocity, yaw):
    assert to_world(to_body(velocity, yaw), yaw) == pytest.approx(velocity, abs=1e-9)


def test_heading_turns_the_frame():
    assert to_body((cos(0.7), sin(0.7), 2.0), 0.7) == pytest.approx((1.0, 0.0, 2.0))
    x, y, _ = to_world((0.0, 1.0, 0.0), pi / 2)
    assert (x, y) == pytest.approx((-1.0, 0.0))
    assert hypot(x, y) == pytest.approx(1.0)


@pytest.mark.parametrize("text", ["rc 1 2 3", "rc 101 0 0 0", "rc a b c d", "rc 1 2 3 4 5", "land", "", "rc 0.5 0 0 0"])
def test_what_is_no_rc_command_is_none(text):
    assert parse_sticks(text) is None


def test_centred_sticks_hover():
    assert CENTRED.command == "rc 0 0 0 0"
    assert to_velocity(CENTRED, GAINS) == ((0.0, 0.0, 0.0), 0.0)
