from math import dist, hypot

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.vector import add
from flockwire_core.wire.phase import Phase

STILL = (0.0, 0.0, 0.0)


def test_it_takes_off_straight_up_and_holds(seat):
    leader = seat()
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(4.0)
    assert leader.phase is Phase.HOLD
    assert leader.position == pytest.approx((0.0, 0.0, 0.95), abs=0.02)


def test_it_flies_its_trajectory_from_where_it_is(flyer):
    begin = add(flyer.position, (-0.3, -0.3, 0.0))
    flyer.run(5.0)
    assert flyer.position == pytest.approx(add(begin, (0.8, 0.8, 0.0)), abs=0.02)
    assert flyer.velocity == pytest.approx((0.1, 0.1, 0.0), abs=0.01)


def test_it_rests_until_the_formations_time_comes(seat):
    leader = seat()
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(3.0)
    leader.order("start", delay=1.0)
    before = leader.position
    leader.run(0.9)
    assert dist(leader.position, before) < 0.02
    assert leader.phase is Phase.HOLD
    leader.run(0.2)
    assert leader.phase is Phase.FORMATION


def test_it_continues_without_a_jump_after_a_hold(flyer):
    flyer.order("hold")
    flyer.run(1.0)
    assert hypot(*flyer.velocity) < 0.05
    flyer.order("start")
    before = flyer.position
    flyer.run(0.1)
    assert dist(flyer.position, before) < 0.05


def test_a_gust_is_made_up_for_within_the_speed_limit(flyer):
    x, y, z = flyer.position
    flyer.push((x + 4.0, y, z))
    flyer.run(0.1)
    assert hypot(*flyer.velocity) == pytest.approx(3.0)
    flyer.run(4.5)
    assert flyer.position[0] == pytest.approx(x + 0.5, abs=0.02)


def test_with_a_lag_it_returns_to_its_course_without_swinging(lagging):
    """Led by its position, with lag and dead time in the loop, it flew 4 cm past its course."""
    y, x = lagging.position[1], []
    lagging.push((lagging.position[0] - 1.0, y, lagging.position[2]))
    for _ in range(600):
        lagging.step()
        x.append(lagging.position[0] - lagging.position[1])  # both advance at 0.1 m/s
    assert min(x) < -0.9
    assert max(x) < 0.01
    assert x[-1] == pytest.approx(0.0, abs=0.01)


def test_it_lands_on_an_order_and_stays_down(flyer):
    flyer.order("land")
    flyer.run(4.0)
    assert (flyer.phase, flyer.state, flyer.velocity) == (Phase.READY, FlightState.GROUNDED, STILL)


@pytest.mark.parametrize("blind", [0.02, 0.5])
def test_a_restart_in_flight_that_sees_itself_late_never_flies_elsewhere(seat, blind):
    leader = seat()
    leader.position, leader.state, leader.silent = (3.0, -2.0, 1.2), FlightState.FLYING, {"pose"}
    leader.run(blind)
    leader.silent = set()
    leader.run(2.0)
    assert leader.position[:2] == pytest.approx((3.0, -2.0), abs=0.1)
