"""Every rung of the staleness ladder, flown by the leader."""

from math import hypot

import pytest
from flockwire_core.domain.order import Stop
from flockwire_core.wire.keys import STOP
from flockwire_core.wire.phase import Phase

STILL = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("silent", "battery", "detail"),
    [
        ({"pose"}, 1.0, "waits for its own pose"),
        ({"telemetry"}, 1.0, "waits for telemetry from kinematics"),
        ({"nearby"}, 1.0, "waits for its nearby bodies"),
        (set(), 0.19, "battery at 19%, take-off needs 20%"),
    ],
)
def test_on_the_ground_it_reports_what_it_waits_for(seat, silent, battery, detail):
    leader = seat()
    leader.silent, leader.battery = silent, battery
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(0.1)
    assert (leader.phase, leader.detail, leader.velocity) == (Phase.GROUNDED, detail, STILL)


def test_without_its_pose_it_stops_and_at_last_lands(flyer):
    flyer.silent = {"pose"}
    flyer.run(0.1)
    assert flyer.velocity != STILL
    flyer.run(0.01)
    assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)
    flyer.run(0.91)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    assert flyer.detail.startswith("own pose lost")


def test_without_telemetry_it_lands(flyer):
    flyer.silent = {"telemetry"}
    flyer.run(2.9)
    assert flyer.phase is Phase.FORMATION
    flyer.run(0.2)
    assert flyer.phase is Phase.LANDING


def test_a_battery_that_runs_out_lands(flyer):
    flyer.battery = 0.09
    flyer.run(0.01)
    assert (flyer.phase, flyer.detail) == (Phase.LANDING, "battery at 9%")


def test_at_the_fence_it_flies_inwards_only_and_beyond_it_lands(flyer):
    flyer.push((10.1, 0.0, 1.0))
    flyer.run(0.01)
    assert flyer.velocity[0] < 0.0
    flyer.push((-10.1, 0.0, 1.0))
    flyer.run(0.01)
    assert flyer.velocity[0] > 0.0
    flyer.push((10.6, 0.0, 1.0))
    flyer.run(0.01)
    assert (flyer.phase, flyer.detail) == (Phase.LANDING, "0.5 m outside the fence")


def test_a_stop_is_final(flyer):
    flyer.core.receive(STOP, Stop(flyer.now, "world", "test"), flyer.now)
    flyer.order("start")
    flyer.run(0.1)
    assert (flyer.phase, flyer.commands) == (Phase.STOPPED, [])


@pytest.fixture
def hurrying(flying):
    """Return a leader that is on its way at 0.8 m/s."""
    leader = flying({"leader.trajectory.velocity": [0.8, 0.0, 0.0]})
    assert hypot(*leader.velocity) == pytest.approx(0.8, abs=0.01)
    return leader


def test_without_nearby_bodies_it_slows_down_then_holds(hurrying):
    hurrying.silent = {"nearby"}
    hurrying.run(0.1)
    assert hypot(*hurrying.velocity) > 0.7
    hurrying.run(0.03)  # it slows down by [limits] acceleration
    assert hurrying.phase is Phase.FORMATION
    assert hypot(*hurrying.velocity) == pytest.approx(0.5, abs=0.001)
    hurrying.run(0.38)
    assert (hurrying.phase, hurrying.detail) == (Phase.HOLD, "nearby bodies are stale")
    hurrying.silent = set()
    hurrying.run(0.05)
    assert hurrying.phase is Phase.FORMATION


def test_with_neighbours_sensing_no_drone_waits_for_nearby(flying):
    leader = flying({"avoidance.sensing": "neighbours"}, {"nearby"})
    leader.run(1.0)
    assert leader.phase is Phase.FORMATION


def test_when_its_pose_comes_back_in_time_it_continues(hurrying):
    hurrying.silent = {"pose"}
    hurrying.run(0.5)
    hurrying.silent = set()
    hurrying.run(0.05)
    assert hurrying.phase is Phase.FORMATION


def test_what_it_reports_is_as_old_as_it_is(hurrying):
    hurrying.silent = {"pose", "nearby", "telemetry"}
    hurrying.run(0.3)
    report = hurrying.core.report(hurrying.now)
    assert (report.pose_age, report.nearby_age, report.telemetry_age) == pytest.approx((0.3, 0.3, 0.3))
    assert report.estimate_age == -1.0
