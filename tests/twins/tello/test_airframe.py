from math import atan, exp, pi

import pytest
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.process.driving import GRAVITY
from flockwire_twins.tello.airframe import STEP, TelloAirframe, clockwise_degrees
from flockwire_twins.tello.parameters import TelloParameters
from hypothesis import given
from hypothesis import strategies as st

HIGH = (0.0, 0.0, 50.0)
speeds = st.floats(-2.0, 2.0)
orders = st.lists(
    st.tuples(st.integers(1, SECOND), st.tuples(speeds, speeds, speeds), st.floats(-3.0, 3.0)), min_size=1, max_size=4
)


def flying(**parameters):
    """Return an airframe that hovers 50 m up."""
    frame = TelloAirframe(TelloParameters(**parameters), 0)
    frame._motion = frame._motion._replace(position=HIGH)
    frame.start(0)
    return frame


@given(orders, st.lists(st.floats(0.0, 1.0), max_size=10))
@pytest.mark.long
def test_the_flight_does_not_depend_on_how_often_it_is_looked_at(script, looks):
    motions = []
    for shares in ([], looks):
        frame, now = flying(), 0
        for wait, velocity, yaw_rate in script:
            for share in sorted(shares):
                frame.advance(now + round(share * wait))
                frame.motion(now + round(share * wait))
            now += wait
            frame.command(velocity, yaw_rate, now)
        frame.advance(now + SECOND)
        motions.append(frame.motion(now + SECOND))
    assert motions[0] == motions[1]


@given(st.floats(0.05, 1.0), st.floats(0.0, 0.4), speeds, st.floats(0.0, 3.0))
def test_a_step_is_answered_by_lag_and_dead_time(lag, dead_time, speed, t):
    frame = flying(lag=lag, dead_time=dead_time)
    frame.command((speed, 0.0, 0.0), 0.0, 0)
    now = nanoseconds(t)
    frame.advance(now)
    late = max(0.0, t - dead_time)
    share = 1.0 - exp(-late / lag)
    motion = frame.motion(now)
    assert motion.velocity[0] == pytest.approx(speed * share, abs=1e-6)
    assert motion.position[0] == pytest.approx(speed * (late - lag * share), abs=1e-6)


def test_it_flies_where_it_faces():
    frame = flying(yaw=pi / 2)
    frame.command((1.0, 0.0, 0.0), 0.0, 0)
    frame.advance(5 * SECOND)
    x, y, z = frame.motion(5 * SECOND).velocity
    assert (x, y, z) == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)


def test_yaw_follows_its_own_lag():
    frame = flying(yaw_lag=0.2, dead_time=0.0)
    frame.command((0.0, 0.0, 0.0), 1.0, 0)
    frame.advance(SECOND)
    share = 1.0 - exp(-5.0)
    assert frame.motion(SECOND).yaw == pytest.approx(1.0 - 0.2 * share, abs=1e-6)


def test_tilt_is_along_the_thrust():
    frame = flying(drag=0.0, lag=0.25, dead_time=0.0)
    frame.command((1.0, 0.0, 0.0), 0.0, 0)
    frame.advance(STEP)
    speeding_up = frame.attitude(STEP)
    acceleration = (1.0 - frame.motion(STEP).velocity[0]) / 0.25
    assert speeding_up.pitch == pytest.approx(-atan(acceleration / GRAVITY))
    assert speeding_up.roll == 0.0
    assert speeding_up.specific_force[:2] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert speeding_up.specific_force[2] < -GRAVITY


def test_it_rolls_to_where_it_flies_and_drag_keeps_it_tilted():
    frame = flying(drag=0.5)
    frame.command((0.0, -1.0, 0.0), 0.0, 0)  # to the right
    frame.advance(5 * SECOND)
    attitude = frame.attitude(5 * SECOND)
    assert attitude.roll == pytest.approx(atan(0.5 / GRAVITY), rel=1e-3)
    assert attitude.pitch == pytest.approx(0.0, abs=1e-6)
    assert attitude.specific_force[1] == pytest.approx(-0.5, rel=0.02)


def test_without_motors_it_falls_and_lies():
    frame = flying()
    frame.cut(0)
    frame.advance(SECOND)
    assert frame.motion(SECOND).position[2] == pytest.approx(50.0 - GRAVITY / 2)
    assert frame.attitude(SECOND).specific_force == (0.0, 0.0, 0.0)
    frame.advance(10 * SECOND)
    assert frame.standing
    assert frame.motion(10 * SECOND).position[2] == 0.0
    assert frame.attitude(10 * SECOND).specific_force == (0.0, 0.0, -GRAVITY)


def test_on_the_ground_it_moves_only_up():
    frame = TelloAirframe(TelloParameters(), 0)
    frame.start(0)
    frame.command((1.0, 0.0, 0.0), 1.0, 0)
    frame.advance(SECOND)
    assert frame.motion(SECOND).position == (0.0, 0.0, 0.0)
    frame.command((0.0, 0.0, 1.0), 0.0, SECOND)
    frame.advance(2 * SECOND)
    assert frame.height > 0.5


@pytest.mark.parametrize(("yaw", "degrees"), [(0.0, 0), (pi / 2, -90), (-pi / 2, 90), (3 * pi, -180), (-0.02, 1)])
def test_degrees_are_clockwise(yaw, degrees):
    assert clockwise_degrees(yaw) == degrees
