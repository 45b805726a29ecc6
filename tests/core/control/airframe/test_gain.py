from math import sin
from random import Random

import pytest
from flockwire_core.control.airframe.disturbance import DisturbedAirframe
from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.control.airframe.gain import HIGHEST, LOWEST, AirframeGain, BandPass
from flockwire_core.domain.vector import ZERO, add, scale, subtract
from hypothesis import given, settings
from hypothesis import strategies as st

DT, LAG, DEAD = 0.01, 0.25, 10  # s, s, steps
angles = st.floats(0.0, 6.28)


def legs(t):
    """Return the velocity of a flight there and back, 0.6 m/s."""
    return (0.6, 0.3, 0.0) if 2.0 <= t < 5.0 else (-0.6, -0.3, 0.0) if 6.0 <= t < 9.0 else ZERO


def learned(gain, wind=lambda _: ZERO, wanted=legs, lag=LAG, dead=DEAD, seconds=10.0, known=None, frozen=()):
    """Fly `wanted`, with the wind compensated as if it were known; returns the estimate after `seconds`."""
    estimate, x, v = AirframeGain(LAG, DEAD * DT), ZERO, ZERO
    commands = [ZERO] * (dead + 1)
    for k in range(round(seconds / DT)):
        t = k * DT
        if not frozen or not frozen[0] <= t < frozen[1]:
            estimate.measure(x, v, t)
        through = subtract(wanted(t), (known or wind)(t))
        estimate.command(through, wanted(t), t)
        commands.append(through)
        x, v = lagged_motion(x, v, add(scale(commands[-1 - dead], gain), wind(t)), lag, DT)
    return estimate


@settings(max_examples=8)
@given(st.floats(0.65, 1.5))
def test_the_gain_is_learned_from_a_flight_there_and_back(gain):
    found = learned(gain)
    assert found.value == pytest.approx(gain, abs=0.12 * abs(gain - 1.0) + 0.005)
    assert found.certainty > 0.8


@settings(max_examples=8)
@given(st.sampled_from((0.7, 1.0, 1.3)), angles, angles, st.floats(-1.0, 1.0))
def test_wind_that_is_compensated_is_not_taken_for_a_gain(gain, a, b, mean):
    def wind(t):
        return (mean + 0.06 * sin(t + a) + 0.03 * sin(2.1 * t + b), 0.06 * sin(t + b) - mean, 0.0)

    assert learned(gain, wind).value == pytest.approx(gain, abs=0.1)


@pytest.mark.parametrize("dead", [7, 10, 13])
def test_sudden_gusts_on_a_drone_that_hovers_are_not_taken_for_a_gain(dead):
    """Then all its commands answer the wind."""
    chance = Random(3)
    gusts = [chance.uniform(-0.7, 0.7) for _ in range(20)]
    state, x, v, given = DisturbedAirframe(LAG, DEAD * DT, 3.0, 10.0), ZERO, ZERO, [ZERO] * (dead + 1)
    for k in range(2000):
        motion = state.measure(x, k * DT, k * DT)
        given.append(state.command(scale(motion.stopping, -3.0), k * DT))
        x, v = lagged_motion(x, v, add(given[-1 - dead], (gusts[k // 100], 0.0, 0.0)), LAG, DT)
    assert state.gain == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("lag", [0.7, 1.3])
@pytest.mark.parametrize("dead", [7, 13])
def test_a_wrong_lag_and_dead_time_are_hardly_taken_for_a_gain(lag, dead):
    assert learned(1.0, lag=LAG * lag, dead=dead).value == pytest.approx(1.0, abs=0.15)


def test_without_motion_the_gain_stays_one():
    found = learned(0.7, lambda t: (0.2 * sin(t), 0.0, 0.0), lambda _: ZERO)
    assert (found.value, found.certainty) == (1.0, 0.0)


def test_the_gain_is_limited():
    assert learned(0.2).value == LOWEST
    assert learned(3.0).value == HIGHEST


def test_a_gain_that_changes_is_followed():
    estimate, x = AirframeGain(0.0, 0.0), 0.0
    for k in range(10000):
        u, gain = (1.5 if k // 50 % 2 else -1.5), (1.3 if k < 4000 else 0.8)
        estimate.measure((x, 0.0, 0.0), (gain * u, 0.0, 0.0), k * DT)
        estimate.command((u, 0.0, 0.0), (u, 0.0, 0.0), k * DT)
        x += DT * u * gain
        if k == 3999:
            assert estimate.value == pytest.approx(1.3, abs=0.01)
    assert estimate.value == pytest.approx(0.8, abs=0.04)
    assert estimate.certainty > 0.9


def test_a_gap_is_left_out():
    assert learned(1.0, frozen=(3.0, 5.5)).value == pytest.approx(1.0, abs=0.01)


def test_reset_forgets():
    estimate = learned(0.7)
    estimate.reset()
    assert (estimate.value, estimate.certainty) == (1.0, 0.0)


def test_the_band_pass_leaves_out_what_is_constant():
    band_pass = BandPass()
    assert band_pass.update(1.0, -2.0, 0.1) == pytest.approx((0.09, -0.18))
    for _ in range(400):
        settled = band_pass.update(1.0, -2.0, 0.1)
    assert settled == pytest.approx((0.0, 0.0))
