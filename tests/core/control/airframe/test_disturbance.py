from itertools import pairwise
from math import dist

import pytest
from flockwire_core.control.airframe.disturbance import DisturbedAirframe
from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.control.airframe.gain import SETTLED, AirframeGain
from flockwire_core.control.airframe.state import LEVEL, VERTICAL, WHOLE, AirframeState
from flockwire_core.domain.vector import ZERO, add, norm, scale, subtract
from hypothesis import given, settings
from hypothesis import strategies as st

DT = 0.01  # s
speeds = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
lags, dead_steps = st.sampled_from((0.0, 0.1, 0.25, 0.4)), st.integers(0, 20)


def flown(state, wind, wanted, lag, dead, gain=1.0, seconds=6.0, learns=WHOLE):
    """Fly `wanted` (velocity at a time) in `wind` (likewise); yield time, true position and the motion at each step."""
    x, v, given = ZERO, ZERO, [ZERO] * (dead + 1)
    for k in range(round(seconds / DT)):
        t = k * DT
        yield t, x, state.measure(x, t, t, learns)
        given.append(state.command(wanted(t), t))
        x, v = lagged_motion(x, v, add(scale(given[-1 - dead], gain), wind(t)), lag, DT)


@settings(max_examples=25)
@given(speeds, speeds, lags, dead_steps)
def test_a_constant_wind_is_found_and_the_drone_flies_as_wanted(wind, wanted, lag, dead):
    state = DisturbedAirframe(lag, dead * DT, most=2.0, fastest=10.0)
    places = [(t, x, motion.stopping) for t, x, motion in flown(state, lambda _: wind, lambda _: wanted, lag, dead)]
    assert dist(state.disturbance, wind) < 1e-3
    (t0, x0, y0), (t1, x1, y1) = places[-100], places[-1]
    for begin, end in ((x0, x1), (y0, y1)):
        assert dist(scale(subtract(end, begin), 1.0 / (t1 - t0)), wanted) < 5e-3


def test_a_wind_that_changes_evenly_is_followed_without_error():
    state = DisturbedAirframe(0.25, 0.1, most=9.0, fastest=10.0)
    late = [
        dist(state.disturbance, (0.2 * t, -0.1 * t, 0.0))
        for t, _, _ in flown(state, lambda t: (0.2 * t, -0.1 * t, 0.0), lambda _: ZERO, 0.25, 10)
    ]
    assert max(late[400:]) < 5e-3


@pytest.mark.parametrize("gain", [0.7, 1.3])
@pytest.mark.parametrize("lag", [0.7, 1.3])
@pytest.mark.parametrize("dead", [7, 13])
def test_with_gain_lag_and_dead_time_wrong_by_30_percent_it_still_settles(gain, lag, dead):
    state = DisturbedAirframe(0.25, 0.1, most=3.0, fastest=10.0)
    flight = flown(state, lambda _: (1.0, 0.0, 0.0), lambda _: (0.5, 0.0, 0.0), 0.25 * lag, dead, gain, seconds=12.0)
    places = [(t, x[0]) for t, x, _ in flight]
    early, late = (
        max(abs((x1 - x0) / DT - 0.5) for (t, x0), (_, x1) in pairwise(places) if at <= t < at + 2.0)
        for at in (4.0, 10.0)
    )
    assert late < max(0.002, 0.4 * early)


@pytest.mark.parametrize("learns", [True, False])
@pytest.mark.parametrize("gain", [0.7, 1.0, 1.3])
@pytest.mark.parametrize("lag", [0.7, 1.3])
@pytest.mark.parametrize("dead", [7, 13])
def test_the_loop_through_the_place_decays_with_all_wrong_by_30_percent(gain, lag, dead, learns, monkeypatch):
    """At the default K = 3 / s, whether the gain has been learned or not."""
    if not learns:
        monkeypatch.setattr(AirframeGain, "measure", lambda *_: None)
    state, y = DisturbedAirframe(0.25, 0.1, most=3.0, fastest=10.0), [0.0]
    away = []
    for t, x, motion in flown(
        state,
        lambda t: (1.0 if t < 1.0 else 0.0, 0.0, 0.0),
        lambda _: (-3.0 * y[0], 0.0, 0.0),
        0.25 * lag,
        dead,
        gain,
        16.0,
    ):
        y[0] = motion.stopping[0]
        away.append((t, abs(x[0])))
    early, late = (max(x for t, x in away if at <= t < at + 3.0) for at in (2.0, 13.0))
    assert late < 0.05 * early


@settings(max_examples=20)
@given(st.lists(speeds, min_size=1, max_size=40), lags, dead_steps)
def test_without_a_disturbance_it_is_the_airframe_of_the_model(commands, lag, dead):
    state, plain = DisturbedAirframe(lag, dead * DT, 2.0, 100.0), AirframeState(lag, dead * DT)
    for t, x, motion in flown(
        state, lambda _: ZERO, lambda t: commands[int(t * 7) % len(commands)], lag, dead, 1.0, 3.0
    ):
        other, known = plain.measure(x, t, t), 1e-9 if t < SETTLED else 1e-5  # then the gain is learned
        assert dist(motion.stopping, other.stopping) < known
        assert dist(motion.velocity, other.velocity) < 10.0 * known
        plain.command(commands[int(t * 7) % len(commands)], t)
    assert dist(state.disturbance, ZERO) < 1e-3
    assert state.gain == pytest.approx(1.0, abs=1e-3)


def test_it_compensates_no_more_than_it_may():
    state = DisturbedAirframe(0.0, 0.0, most=0.5, fastest=10.0)
    for _ in flown(state, lambda _: (1.0, 0.0, 0.0), lambda _: ZERO, 0.0, 0):
        assert state.speed(2.0) >= 1.5 - 1e-12
    assert state.disturbance == pytest.approx((0.5, 0.0, 0.0))
    assert state.command(ZERO, 9.0) == pytest.approx((-0.5, 0.0, 0.0))
    assert state.last_command == ZERO
    assert state.speed(0.2) == 0.0


def test_in_a_wind_that_it_cannot_fly_against_it_is_known_what_it_flies():
    """Full speed is 1 m/s, and its gain 0.86: it drifts, as its model says."""
    state = DisturbedAirframe(0.25, 0.1, most=1.5, fastest=1.0)
    seen = [
        (t, motion.stopping[0] - state.travelled(t)[0])
        for t, _, motion in flown(state, lambda _: (1.4, 0.0, 0.0), lambda _: ZERO, 0.25, 10, 0.86)
    ]
    assert norm(state.command(ZERO, 9.0)) == pytest.approx(1.0)
    (t0, before), (t1, after) = seen[-100], seen[-1]
    assert (after - before) / (t1 - t0) == pytest.approx(1.4 + 1.0 - 0.86, abs=0.01)  # the wind, and the wrong gain


def test_it_learns_only_when_it_may_and_only_along_the_given_axes():
    wind = (0.4, 0.0, -0.4)
    for learns, found in ((None, ZERO), (LEVEL, (0.4, 0.0, 0.0)), (VERTICAL, (0.0, 0.0, -0.4)), (WHOLE, wind)):
        state = DisturbedAirframe(0.1, 0.0, 2.0, 10.0)
        for _ in flown(state, lambda _: wind, lambda _: ZERO, 0.1, 0, learns=learns):
            pass
        assert state.disturbance == pytest.approx(found, abs=1e-3)


def test_a_jump_of_the_measurement_is_no_wind():
    state = DisturbedAirframe(0.0, 0.0, 2.0, fastest=6.0)
    for k in range(10):
        state.measure((0.0 if k < 5 else 1.0, 0.0, 0.0), k * DT, k * DT)
        state.command(ZERO, k * DT)
    assert state.disturbance == ZERO


def test_a_reset_forgets_the_wind():
    state = DisturbedAirframe(0.1, 0.0, 2.0, 10.0)
    for _ in flown(state, lambda _: (1.0, 0.0, 0.0), lambda _: ZERO, 0.1, 0):
        pass
    state.reset()
    assert state.disturbance == ZERO
    assert state.command((0.1, 0.0, 0.0), 9.0) == (0.1, 0.0, 0.0)


def test_what_is_no_longer_learned_is_kept_though_it_was_changing():
    state = DisturbedAirframe(0.0, 0.0, 2.0, 10.0)
    for _ in flown(state, lambda t: (0.2 * t, 0.0, 0.0), lambda _: ZERO, 0.0, 0, seconds=3.0):
        pass
    x = state.disturbance[0]
    for k in range(300, 500):
        state.measure((9.0, 0.0, 0.0), k * DT, k * DT, VERTICAL)
        state.command(ZERO, k * DT)
    assert state.disturbance[0] == x > 0.5


def test_its_vertical_part_can_be_limited():
    state = DisturbedAirframe(0.1, 0.0, 2.0, 10.0)
    for _ in flown(state, lambda _: (0.4, 0.0, -1.0), lambda _: ZERO, 0.1, 0):
        pass
    state.limit_vertical(0.3)
    assert state.disturbance == pytest.approx((0.4, 0.0, -0.3), abs=1e-3)


def test_a_gain_that_is_learned_in_wind_hardly_moves_a_drone_that_hovers(monkeypatch):
    """Applied at once, it moved the command by 0.2 m/s and the drone by 42 mm; so it moves 18 mm."""
    monkeypatch.setattr(AirframeGain, "measure", lambda *_: None)
    state, y, away = DisturbedAirframe(0.25, 0.1, most=3.0, fastest=10.0), [0.0], []
    for t, x, motion in flown(state, lambda _: (1.0, 0.0, 0.0), lambda _: (-3.0 * y[0], 0.0, 0.0), 0.25, 10, 1.0, 14.0):
        y[0] = motion.stopping[0]
        state._gain.value = 1.0 if t < 8.0 else 1.25
        away.append((t, abs(x[0])))
    assert max(x for t, x in away if 7.0 <= t < 8.0) < 0.001 < max(x for t, x in away if t >= 8.0) < 0.02
    assert state.gain == pytest.approx(1.25, abs=0.001)
    state.reset()
    assert state.gain == 1.0
