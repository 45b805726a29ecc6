"""A body moves as its drone is commanded, within what nobody knows of airframe and wind, or it is not the drone's."""

from math import cos, pi, sin

import pytest
from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.control.airframe.motion_residual import MotionResidual
from flockwire_core.control.airframe.state import AirframeState
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, add, scale
from hypothesis import given
from hypothesis import strategies as st

DT, LOOK = 0.02, 5  # s between two steps, steps between two looks


class Flight:
    """An airframe with a true gain and lag in a wind, and the residual of its pilot, who knows a lag of `lag` s."""

    def __init__(self, lag=0.2, gain=1.0, true=1.0, wind=ZERO, drift=1.5):
        self.state, self.residual = AirframeState(lag, 0.0), MotionResidual(drift, lag)
        self.gain, self.lag, self.wind = gain, lag * true, wind
        self.now, self.position, self.velocity = 0.0, (1.0, 2.0, 1.0), ZERO
        self.apart, self.repeats = 0.0, False

    def fly(self, seconds, command, seen=lambda position, _: position):
        """Fly by `command` of the time; the tracker reports `seen` of the true position and the time."""
        for k in range(round(seconds / DT)):
            self.now += DT
            u = command(self.now)
            self.state.command(u, self.now - DT)
            flown = add(scale(u, self.gain), self.wind)
            self.position, self.velocity = lagged_motion(self.position, self.velocity, flown, self.lag, DT)
            motion = self.state.measure(seen(self.position, self.now), self.now, self.now)
            if k % LOOK == 0:
                self.residual.update(motion, self.state.travelled(self.now), self.now)
                self.apart = max(self.apart, self.residual.apart())
                self.repeats = self.repeats or self.residual.repeats(0.0)
        return self


def round_about(speed, period):
    """Return commands that fly circles."""
    return lambda t: (speed * cos(2.0 * pi * t / period), speed * sin(2.0 * pi * t / period), 0.2 * sin(t))


speeds, angles = st.floats(0.0, 3.0), st.floats(0.0, 2.0 * pi)


@given(
    lag=st.floats(0.0, 0.4), gain=st.floats(0.7, 1.3), true=st.floats(0.4, 1.6), wind=st.floats(0.0, 1.45),
    angle=angles, speed=speeds, period=st.floats(1.0, 20.0), stops=st.booleans(),
)  # fmt: skip
def test_an_airframe_that_nobody_knows_well_in_wind_is_its_own(lag, gain, true, wind, angle, speed, period, stops):
    flight = Flight(lag, gain, true, (wind * cos(angle), wind * sin(angle), 0.0))
    flight.fly(3.0, round_about(speed, period))
    if stops:
        flight.fly(1.0, lambda _: ZERO).fly(1.0, lambda _: (-speed, 0.0, 0.0))
    assert (flight.apart, flight.repeats) == (0.0, False)


@given(gain=st.floats(0.7, 1.3), wind=st.floats(0.0, 1.45), angle=angles)
def test_without_noise_an_airframe_that_balances_the_wind_stands_bit_for_bit(gain, wind, angle):
    flight = Flight(0.0, gain, 1.0, (wind * cos(angle), wind * sin(angle), 0.0))
    against = scale(flight.wind, -1.0 / gain)
    where = flight.position
    flight.fly(4.0, lambda _: against, lambda *_: where)  # what rounding leaves of the balance
    assert (flight.apart, flight.repeats) == (0.0, False)


@pytest.mark.parametrize("answer", [-1.0, 0.0])
@pytest.mark.parametrize("speed", [2.0, 3.0])
def test_a_body_that_follows_another_drone_is_apart(answer, speed):
    flight = Flight()
    start = flight.position
    flight.fly(2.5, lambda _: (speed, 0.0, 0.0), lambda p, _: (start[0] + answer * (p[0] - start[0]), p[1], p[2]))
    assert (flight.apart > 0.0) is (speed * (1.0 - answer) >= 3.0)


@pytest.mark.parametrize("speed", [0.3, 0.5, 3.0])
def test_a_pose_that_freezes_on_the_way_is_repeated(speed):
    flight = Flight().fly(3.0, lambda _: (speed, 0.0, 0.0))
    assert not flight.repeats
    frozen = flight.position
    flight.fly(1.5, lambda _: (speed, 0.0, 0.0), lambda *_: frozen)
    assert flight.repeats


def test_a_pose_that_froze_in_hover_is_repeated_as_soon_as_the_drone_is_commanded():
    flight = Flight(wind=(0.5, 0.0, 0.0)).fly(6.0, lambda _: (-0.5, 0.0, 0.0))
    frozen = flight.position
    flight.fly(3.0, lambda _: (-0.5, 0.0, 0.0), lambda *_: frozen)
    assert not flight.repeats
    flight.fly(1.0, lambda _: (0.0, 0.0, 0.0), lambda *_: frozen)
    assert flight.repeats


@given(
    lag=st.sampled_from([0.0, 0.05, 0.3]), gain=st.floats(0.7, 1.3), wind=st.floats(0.0, 1.0), speed=speeds,
    slowing=st.floats(0.0, 2.0),
)  # fmt: skip
def test_one_that_stops_without_noise_stands_bit_for_bit(lag, gain, wind, speed, slowing):
    flight = Flight(lag, gain, wind=(0.0, wind, 0.0))
    flight.fly(2.0, lambda _: (speed, 0.0, 0.0))
    still = scale(flight.wind, -1.0 / gain)
    flight.fly(6.0, lambda t: add((max(0.0, speed - slowing * (t - 2.0)) if slowing else 0.0, 0.0, 0.0), still))
    assert not flight.repeats


def test_a_slow_tracker_may_repeat_a_pose():
    flight, last = Flight(), [ZERO, -1.0]

    def ten_a_second(position, now):
        if now - last[1] >= 0.1:
            last[:] = position, now
        return last[0]

    flight.fly(5.0, round_about(2.0, 6.0), ten_a_second)
    assert not flight.repeats


def test_a_height_that_the_airframe_does_not_fly_is_another_bodys():
    residual, down, up = MotionResidual(1.5, 0.2), (0.0, 0.0, -0.7), (0.0, 0.0, 3.0)
    sinks = [residual.rise(Motion((0.0, 0.0, 2.0 - 0.07 * k), down, ZERO), 2.0, 0.1, 0.1 * k) for k in range(20)]
    assert sinks[10] == 0.0
    assert sinks[-1] > 0.8
    heights = [2.0 + 0.3 * max(0, k) for k in range(-3, 20)]  # by telemetry that is 0.3 s old
    seen = [Motion((0.0, 0.0, heights[k + 3]), up, ZERO) for k in range(20)]
    assert not any(residual.rise(seen[k], heights[k], 0.3, 9.0 + 0.1 * k) for k in range(20))
