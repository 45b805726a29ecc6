from math import exp

import pytest
from flockwire.control.first_order_lag import lagged, lagged_motion
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
