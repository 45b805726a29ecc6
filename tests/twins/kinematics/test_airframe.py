from math import exp

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.drones import Airframe
from flockwire_twins.kinematics.airframe import FirstOrderAirframe
from flockwire_twins.wind import Wind
from hypothesis import given
from hypothesis import strategies as st

HIGH = (0.0, 0.0, 50.0)
speeds = st.floats(-2.0, 2.0)
commands = st.lists(st.tuples(st.integers(1, SECOND), st.tuples(speeds, speeds, speeds)), min_size=1, max_size=6)
airframes = st.builds(
    Airframe, gain=st.floats(0.5, 1.5), lag=st.just(0.0) | st.floats(0.01, 1.0), dead_time=st.floats(0.0, 0.5)
)


def flown(parameters, orders, looks=(), wind=None):
    """Fly `orders` (ns until the command, command); the state is also looked at, at `looks` (shares of the flight)."""
    frame = FirstOrderAirframe(parameters, HIGH, 0)
    if wind is not None:
        frame.blow(wind)
    end = sum(wait for wait, _ in orders) + SECOND
    moments, at = [(round(look * end), None) for look in looks], 0
    for wait, velocity in orders:
        at += wait
        moments.append((at, velocity))
    for moment, velocity in sorted(moments, key=lambda m: m[0]):
        if velocity is not None:
            frame.command(velocity, moment)
        else:
            frame.advance(moment)
    frame.advance(end)
    return frame


@given(airframes, commands, st.lists(st.floats(0.0, 1.0), max_size=20))
def test_the_answer_does_not_depend_on_how_often_it_is_looked_at(parameters, orders, looks):
    once, often = flown(parameters, orders), flown(parameters, orders, looks)
    assert often.position == pytest.approx(once.position, abs=1e-9)
    assert often.velocity == pytest.approx(once.velocity, abs=1e-9)
    assert often.battery == pytest.approx(once.battery, abs=1e-9)


def test_the_ideal_airframe_integrates_its_command():
    frame = FirstOrderAirframe(Airframe(), HIGH, 0)
    frame.command((1.0, -2.0, 0.5), 0)
    frame.advance(2 * SECOND)
    assert frame.velocity == (1.0, -2.0, 0.5)
    assert frame.position == pytest.approx((2.0, -4.0, 51.0))


@given(st.floats(0.02, 1.0), st.floats(0.0, 0.5), st.floats(0.5, 1.5), st.floats(0.0, 3.0))
def test_a_step_is_answered_by_the_closed_form(lag, dead_time, gain, t):
    frame = FirstOrderAirframe(Airframe(gain=gain, lag=lag, dead_time=dead_time), HIGH, 0)
    frame.command((1.0, 0.0, 0.0), 0)
    frame.advance(nanoseconds(t))
    late = max(0.0, t - dead_time)
    share = 1.0 - exp(-late / lag)
    assert frame.velocity[0] == pytest.approx(gain * share, abs=1e-6)
    assert frame.position[0] == pytest.approx(gain * (late - lag * share), abs=1e-6)


def test_nothing_happens_within_the_dead_time():
    frame = FirstOrderAirframe(Airframe(dead_time=0.2), HIGH, 0)
    frame.command((1.0, 0.0, 0.0), 0)
    frame.advance(SECOND // 5)
    assert frame.position == HIGH


def test_on_the_ground_only_a_command_to_rise_does_anything():
    frame = FirstOrderAirframe(Airframe(), (0.0, 0.0, 0.0), 0)
    frame.command((1.0, 0.0, 0.0), 0)
    frame.advance(SECOND)
    assert (frame.state, frame.position) == (FlightState.GROUNDED, (0.0, 0.0, 0.0))
    frame.command((0.0, 0.0, 0.5), SECOND)
    frame.advance(2 * SECOND)
    assert (frame.state, frame.position) == (FlightState.FLYING, pytest.approx((0.0, 0.0, 0.5)))


@pytest.mark.parametrize("lag", [0.0, 0.25])
def test_sinking_to_the_ground_it_stands(lag):
    frame = FirstOrderAirframe(Airframe(lag=lag), (0.0, 0.0, 1.0), 0)
    frame.command((0.0, 0.0, -0.7), 0)
    for k in range(1, 250):
        frame.advance(k * SECOND // 100)
    assert frame.state is FlightState.GROUNDED
    assert frame.position == (0.0, 0.0, 0.0)
    assert frame.velocity == (0.0, 0.0, 0.0)


def test_one_that_took_off_again_after_a_landing_climbs():
    frame = FirstOrderAirframe(Airframe(lag=0.25, dead_time=0.1), (0.0, 0.0, 0.3), 0)
    for k in range(400):
        frame.command((0.0, 0.0, -0.7 if k < 200 else 0.7), k * SECOND // 100)
        frame.advance((k + 1) * SECOND // 100)
    assert frame.state is FlightState.FLYING
    assert frame.position[2] > 0.8


def test_after_a_stop_it_falls_to_the_ground_and_stays_stopped():
    frame = FirstOrderAirframe(Airframe(), (0.0, 0.0, 1.0), 0)
    frame.command((1.0, 0.0, 0.0), 0)
    frame.advance(SECOND // 10)
    frame.stop()
    frame.advance(SECOND // 10 + SECOND // 100)
    assert frame.velocity[2] < 0.0
    for k in range(12, 100):
        frame.advance(k * SECOND // 100)
        frame.command((0.0, 0.0, 1.0), k * SECOND // 100)
    assert (frame.state, frame.position[2], frame.velocity) == (FlightState.STOPPED, 0.0, (0.0, 0.0, 0.0))


def test_a_fall_does_not_depend_on_how_often_it_is_looked_at():
    heights = []
    for looks in (1, 50):
        frame = FirstOrderAirframe(Airframe(), HIGH, 0)
        frame.stop()
        for k in range(1, looks + 1):
            frame.advance(k * SECOND // looks)
        heights.append(frame.position[2])
    assert heights == pytest.approx([50.0 - 9.81 / 2] * 2)


def test_the_battery_drains_in_flight_only_and_never_below_empty():
    frame = FirstOrderAirframe(Airframe(endurance=100.0), (0.0, 0.0, 0.0), 0)
    frame.advance(50 * SECOND)
    assert frame.battery == 1.0
    frame.command((0.0, 0.0, 0.01), 50 * SECOND)
    frame.advance(75 * SECOND)
    assert frame.battery == pytest.approx(0.75)
    frame.advance(500 * SECOND)
    assert frame.battery == 0.0


WIND = Wind((0.4, -0.2, 0.0), 0.3, lambda: 0.3)


@given(airframes, commands, st.lists(st.floats(0.0, 1.0), max_size=20))
def test_nor_in_a_wind(parameters, orders, looks):
    once, often = flown(parameters, orders, wind=WIND), flown(parameters, orders, looks, wind=WIND)
    assert often.position == pytest.approx(once.position, abs=1e-9)
    assert often.velocity == pytest.approx(once.velocity, abs=1e-9)


def test_at_a_zero_command_it_drifts_with_the_wind():
    frame = FirstOrderAirframe(Airframe(lag=0.2, gain=0.7), HIGH, 0)
    frame.blow(Wind((1.0, 0.0, -0.1), 0.0, lambda: 0.5))
    frame.advance(4 * SECOND)
    assert frame.velocity == pytest.approx((1.0, 0.0, -0.1), abs=1e-6)
    frame.blow(Wind((0.0, 0.0, 0.0), 0.0, lambda: 0.5))
    frame.advance(8 * SECOND)
    assert frame.velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_one_that_stands_is_not_blown_away():
    frame = FirstOrderAirframe(Airframe(), (0.0, 0.0, 0.0), 0)
    frame.blow(WIND)
    frame.advance(SECOND)
    assert frame.position == (0.0, 0.0, 0.0)
