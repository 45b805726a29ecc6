from math import dist, hypot

import pytest
from flockwire_core.control.trajectory import Circling, Constant, Waypoints
from hypothesis import given
from hypothesis import strategies as st

SQUARE = ((1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.5))
EACH = [
    Constant((0.1, -0.2, 0.05)),
    Circling(1.5, 0.3),
    Circling(1.0, -0.3),
    Waypoints(SQUARE, 0.2),
    Waypoints(SQUARE, 0.2, loop=True),
]
each = pytest.mark.parametrize("trajectory", EACH, ids=lambda t: type(t).__name__)


@each
@given(st.floats(-100.0, 0.0))
def test_before_its_time_it_rests_at_the_start(trajectory, t):
    assert trajectory.position(t) == (0.0, 0.0, 0.0)
    assert trajectory.rate(t) == (0.0, 0.0, 0.0)


@each
@given(st.floats(0.001, 60.0))
def test_the_rate_is_the_positions_derivative(trajectory, t):
    step = 1e-6
    a, b = trajectory.position(t - step), trajectory.position(t + step)
    if trajectory.rate(t - step) != trajectory.rate(t + step) and isinstance(trajectory, Waypoints):
        return  # a corner has two
    slope = tuple((y - x) / (2 * step) for x, y in zip(a, b, strict=True))
    assert slope == pytest.approx(trajectory.rate(t), abs=1e-6)


@each
@given(st.floats(0.0, 100.0), st.floats(0.0, 0.1))
def test_it_never_jumps(trajectory, t, dt):
    assert dist(trajectory.position(t), trajectory.position(t + dt)) <= 0.5 * dt + 1e-9


def test_a_circle_touches_its_start_and_keeps_its_radius():
    circle = Circling(2.0, 0.5)
    assert all(dist(circle.position(t), (0.0, 2.0, 0.0)) == pytest.approx(2.0) for t in range(20))
    assert hypot(*circle.rate(3.0)) == pytest.approx(1.0)


def test_waypoints_are_passed_at_the_speed_and_the_last_one_is_kept():
    path = Waypoints(SQUARE[:2], 0.5)
    assert path.position(2.0) == pytest.approx(SQUARE[0])
    assert path.position(4.0) == pytest.approx(SQUARE[1])
    assert path.position(1e6) == SQUARE[1]
    assert path.rate(1e6) == (0.0, 0.0, 0.0)


def test_a_loop_comes_back_to_the_start_and_continues():
    path = Waypoints(SQUARE[:2], 0.5, loop=True)
    lap = (1.0 + 1.0 + hypot(1.0, 1.0)) / 0.5
    assert path.position(lap) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert path.position(lap + 1.0) == pytest.approx((0.5, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("loop", [False, True])
def test_a_path_that_goes_nowhere_rests(loop):
    path = Waypoints(((0.0, 0.0, 0.0),), 0.5, loop)
    assert path.position(3.0) == path.rate(3.0) == (0.0, 0.0, 0.0)


def test_repeated_points_take_no_time():
    twice = Waypoints((SQUARE[0], SQUARE[0], SQUARE[1]), 0.5)
    once = Waypoints((SQUARE[0], SQUARE[1]), 0.5)
    assert all(twice.position(t / 7) == once.position(t / 7) for t in range(40))
