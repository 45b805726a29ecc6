from math import atan, exp, inf, pi

import pytest
from flockwire_core.control.airframe.first_order_lag import critical_gain, lagged, lagged_motion, smallest_smoothing
from hypothesis import given
from hypothesis import strategies as st

numbers = st.floats(-10.0, 10.0)


@given(numbers, numbers, numbers, st.floats(0.01, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_two_steps_are_one(x, v, u, lag, first, second):
    once = lagged(x, v, u, lag, first + second)
    assert lagged(*lagged(x, v, u, lag, first), u, lag, second) == pytest.approx(once, abs=1e-9)


def test_a_step_is_answered_by_the_closed_form():
    assert lagged(0.0, 0.0, 1.0, 0.25, 0.5) == pytest.approx((0.5 - 0.25 * (1 - exp(-2)), 1 - exp(-2)))


def test_without_lag_it_moves_at_once():
    assert lagged(1.0, 0.0, 2.0, 0.0, 0.5) == (2.0, 2.0)


@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_three_axes_are_three_times_one(lag):
    x, v, u = (1.0, -2.0, 0.5), (0.1, 0.7, -0.4), (-0.3, 0.0, 1.2)
    axes = [lagged(x[k], v[k], u[k], lag, 0.01) for k in range(3)]
    assert lagged_motion(x, v, u, lag, 0.01) == tuple(zip(*axes, strict=True))


def swing_ratio(gain, lag, dead_time, dt=0.001, seconds=40.0):
    """Return the late swing over the early swing of x' = v, lag v' + v = −gain x(t − dead_time), from x = 1."""
    delay = round(dead_time / dt)
    track, velocity = [1.0] * (delay + 1), 0.0
    for _ in range(round(seconds / dt)):
        velocity += dt / lag * (-gain * track[-1 - delay] - velocity)
        track.append(track[-1] + dt * velocity)
    quarter = len(track) // 4
    return max(map(abs, track[-quarter:])) / max(map(abs, track[quarter : 2 * quarter]))


@pytest.mark.parametrize(("lag", "dead_time"), [(0.25, 0.11), (0.1, 0.2)])
def test_the_critical_gain_divides_growing_from_decaying_swings(lag, dead_time):
    critical = critical_gain(lag, dead_time)
    assert swing_ratio(0.93 * critical, lag, dead_time) < 0.8
    assert swing_ratio(1.07 * critical, lag, dead_time) > 1.25


@given(st.floats(0.001, 2.0))
def test_dead_time_alone_has_the_textbook_value(dead_time):
    assert critical_gain(0.0, dead_time) == pytest.approx(pi / (2 * dead_time))


@given(st.floats(0.0, 5.0), st.floats(1e-4, 2.0))
def test_the_phase_condition_holds(lag, dead_time):
    critical = critical_gain(lag, dead_time)
    # k = w sqrt(1 + (w lag)^2) solved for w.
    w = critical * (2.0 / (1.0 + (1.0 + (2.0 * critical * lag) ** 2) ** 0.5)) ** 0.5
    assert atan(w * lag) + w * dead_time == pytest.approx(pi / 2)


def test_without_dead_time_every_gain_is_stable():
    assert critical_gain(0.0, 0.0) == inf
    assert critical_gain(0.3, 0.0) == inf
    assert smallest_smoothing(3.0, 1.0, 0.3, 0.0) == 0.0


@given(st.floats(0.1, 5.0), st.floats(0.01, 2.0), st.floats(0.0, 0.5), st.floats(0.01, 0.3))
def test_the_smallest_smoothing_meets_the_margin_exactly(formation_gain, compensation_gain, lag, dead_time):
    smoothing = smallest_smoothing(formation_gain, compensation_gain, lag, dead_time)
    allowed = critical_gain(lag, dead_time) / 2.0
    if smoothing is None:
        assert formation_gain >= allowed
    else:
        assert formation_gain + compensation_gain / smoothing == pytest.approx(allowed)


def test_the_papers_flight_gains_need_a_larger_epsilon_on_a_lagging_airframe():
    critical = critical_gain(lag=0.25, dead_time=0.11)
    assert critical < 3.0 + 1.0 / 0.01
    assert critical > 3.0 + 1.0 / 0.3
    assert 0.3 < smallest_smoothing(3.0, 1.0, 0.25, 0.11) < 0.6
