"""A tracked body that moves apart from its commands is found; a wrong airframe and a drift of 0.1 m/s are not."""

from __future__ import annotations

from math import cos, sin

import pytest
from flockwire.control.airframe.motion_residual import MotionResidual

STEP = 0.1  # s


def found_after(motion, command, seconds=20.0):
    """Return when the residual is found, s; None if never. `motion` and `command` return m/s at a time, s."""
    residual = MotionResidual(drift=0.15, fastest=6.0)
    stopping, travelled = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    for k in range(round(seconds / STEP)):
        if residual.update(stopping, travelled, k * STEP):
            return k * STEP
        stopping = tuple(a + STEP * b for a, b in zip(stopping, motion(k * STEP), strict=True))
        travelled = tuple(a + STEP * b for a, b in zip(travelled, command(k * STEP), strict=True))
    return None


def still(_):
    return (0.0, 0.0, 0.0)


def steady(x):
    return lambda _: (x, 0.0, 0.0)


def circle(t):
    """Return the paper's: 2 m at 1 rad/s."""
    return (2.0 * cos(t), -2.0 * sin(t), 0.0)


@pytest.mark.parametrize(("drift", "within"), [(0.3, 5.0), (0.5, 2.5), (1.0, 1.5)])
def test_a_body_that_the_tracker_moves_away_is_found(drift, within):
    assert found_after(still, steady(-drift)) <= within


def test_a_body_that_the_tracker_moves_away_on_a_circle_is_found():
    pushed = lambda t: (circle(t)[0] - 0.7, circle(t)[1], 0.0)  # noqa: E731
    assert found_after(circle, pushed) <= 6.0


@pytest.mark.parametrize("gain", [0.8, 1.2])
@pytest.mark.parametrize("command", [steady(3.0), circle])
def test_an_airframe_with_another_gain_is_not(gain, command):
    assert found_after(lambda t: tuple(gain * u for u in command(t)), command) is None


def test_an_airframe_with_another_lag_is_not():
    late = lambda t: circle(t - 0.15)  # noqa: E731
    assert found_after(late, circle) is None


def test_the_drift_of_a_hovering_airframe_is_not():
    assert found_after(steady(0.1), still) is None


def test_a_jump_is_not_motion():
    jump = lambda t: (9.0, 0.0, 0.0) if 3.0 < t < 3.2 else (0.0, 0.0, 0.0)  # noqa: E731
    assert found_after(jump, still) is None
