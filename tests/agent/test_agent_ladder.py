"""Every rung of the staleness ladder, flown."""

from math import hypot

import pytest
from flockwire.flight.phases import Phase
from flockwire.wire.messages import FlightState, Leading

TWO = {"graph.edges": [[0, 1], [0, 2], [1, 2], [2, 3], [3, 4]]}
STILL = (0.0, 0.0, 0.0)


@pytest.fixture
def flyer(cockpit):
    """Return agent 2, which hears the leader and uav1, in formation and on its way."""
    agent = cockpit(TWO, number=2).fly()
    x, y, z = agent.position
    agent.position = (x + 0.8, y, z)
    agent.step()
    return agent


def test_without_its_pose_it_stops_at_once_and_lands_after_a_second(flyer):
    flyer.silent = {"pose"}
    flyer.run(0.1)
    assert hypot(*flyer.velocity) > 0.5
    flyer.step()
    assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)
    flyer.run(0.89)
    assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)
    flyer.run(0.02)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    assert flyer.report.detail.startswith("own pose lost")


def test_when_its_pose_comes_back_in_time_it_goes_on(flyer):
    flyer.silent = {"pose"}
    flyer.run(0.5)
    flyer.silent.clear()
    flyer.run(0.05)
    assert flyer.phase is Phase.FORMATION


def test_a_silent_neighbour_leaves_the_sum_after_its_time(flyer):
    flyer.run(2.0)
    flyer.silent = {"uav1"}
    flyer.run(0.25)
    settled = flyer.estimate.position
    flyer.leader = (0.0, 0.5, 1.0)  # the leader alone tells so; uav1's last word still counts
    flyer.step()
    flyer.run(0.3)
    flyer.run(2.0)
    assert flyer.phase is Phase.FORMATION
    assert flyer.estimate.position == pytest.approx(flyer.leader, abs=1e-3)
    assert settled == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    assert flyer.report.estimate_age > 2.0


def test_without_any_neighbour_it_holds_and_at_last_lands(flyer):
    flyer.silent = {"uav0", "uav1"}
    flyer.run(0.98)
    assert flyer.phase is Phase.FORMATION
    flyer.run(0.05)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "no news of the leader for 1 s")
    flyer.run(3.95)
    assert flyer.phase is Phase.HOLD
    flyer.run(0.05)
    assert flyer.phase is Phase.LANDING
    assert flyer.report.detail.startswith("news of the leader lost")


def test_old_news_that_neighbours_pass_on_is_no_news(cockpit):
    agent = cockpit(number=2).fly()
    agent.silent = {"origin"}
    agent.run(0.98)
    assert agent.phase is Phase.FORMATION
    agent.run(0.05)
    assert (agent.phase, agent.report.detail) == (Phase.HOLD, "no news of the leader for 1 s")
    assert agent.report.estimate_age < 0.02
    agent.silent.clear()
    agent.run(0.05)
    assert agent.phase is Phase.FORMATION


@pytest.mark.parametrize("phase", [Phase.LANDING, Phase.GROUNDED, Phase.STOPPED])
def test_while_the_leader_is_down_it_holds_and_at_last_lands(flyer, phase):
    flyer.leader_phase = phase
    flyer.run(0.05)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "the leader is down")
    assert flyer.estimate.leading is Leading.IS_DOWN
    flyer.run(4.9)
    assert flyer.phase is Phase.HOLD
    flyer.run(0.1)
    assert flyer.phase is Phase.LANDING
    assert flyer.report.detail.startswith("leader lost for 5.0 s")


def test_a_leader_whose_status_is_silent_counts_as_down(flyer):
    flyer.silent = {"status"}
    flyer.run(0.98)
    assert flyer.phase is Phase.FORMATION
    flyer.run(0.05)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "the leader is down")
    flyer.silent.clear()
    flyer.run(0.05)
    assert flyer.phase is Phase.FORMATION


def test_without_neighbours_the_estimate_stays(flyer):
    flyer.silent = {"uav0", "uav1"}
    flyer.run(0.35)
    last = flyer.estimate.position
    flyer.run(1.0)
    assert flyer.estimate.position == last


def test_blind_to_what_is_nearby_it_slows_down_then_holds(flyer):
    flyer.silent = {"nearby"}
    flyer.run(0.1)
    assert hypot(*flyer.velocity) > 0.5
    flyer.step()
    assert flyer.phase is Phase.FORMATION
    assert hypot(*flyer.velocity) == pytest.approx(0.5)
    flyer.run(0.4)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "nearby bodies are stale")
    assert hypot(*flyer.velocity) <= 0.5


def test_with_neighbours_sensing_nobody_waits_for_nearby(cockpit):
    agent = cockpit({"avoidance.sensing": "neighbours"}, number=2)
    agent.silent = {"nearby"}
    agent.fly().run(1.0)
    assert agent.phase is Phase.FORMATION


def test_without_telemetry_it_lands_after_three_seconds(flyer):
    flyer.silent = {"telemetry"}
    flyer.run(2.0)
    assert flyer.phase is Phase.FORMATION
    assert flyer.report.telemetry_age == pytest.approx(2.0)
    flyer.run(1.02)
    assert flyer.phase is Phase.LANDING
    assert flyer.report.detail.startswith("telemetry lost")


@pytest.mark.parametrize(("battery", "phase"), [(0.15, Phase.FORMATION), (0.09, Phase.LANDING)])
def test_a_battery_that_runs_out_lands(flyer, battery, phase):
    flyer.battery = battery
    flyer.step()
    assert flyer.phase is phase


def test_at_the_fence_it_flies_inwards_only(flyer):
    flyer.leader = (30.0, 0.0, 1.0)
    flyer.position = (10.2, 0.0, 1.0)
    flyer.run(1.0)
    assert flyer.phase is Phase.FORMATION
    assert flyer.velocity[0] == 0.0
    flyer.leader = (-30.0, 0.0, 1.0)
    flyer.run(30.0)
    assert flyer.velocity[0] < 0.0


def test_beyond_the_fences_margin_it_lands(flyer):
    flyer.position = (10.6, 0.0, 1.0)
    flyer.step()
    assert (flyer.phase, flyer.report.detail) == (Phase.LANDING, "0.6 m outside the fence")


def test_a_stop_ends_everything(flyer):
    flyer.stop()
    flyer.order("start", flyer.now)
    flyer.run(0.1)
    assert (flyer.phase, flyer.velocity) == (Phase.STOPPED, STILL)


def test_landed_by_a_failure_it_stays_until_a_new_order(flyer):
    flyer.holds_still = False
    flyer.silent = {"telemetry"}
    flyer.run(3.1)
    flyer.silent.clear()
    flyer.run(5.0)
    assert (flyer.phase, flyer.state) == (Phase.READY, FlightState.GROUNDED)
    flyer.order("takeoff")
    flyer.run(0.1)
    assert flyer.phase is Phase.TAKEOFF


def test_set_down_by_its_driver_it_does_not_rise_on_the_old_order(flyer):
    flyer.state, flyer.position = FlightState.GROUNDED, (flyer.position[0], flyer.position[1], 0.0)
    flyer.run(0.5)
    assert flyer.phase in (Phase.GROUNDED, Phase.READY)
    assert flyer.velocity == STILL


def test_a_long_pause_of_the_process_makes_no_leap(flyer):
    flyer.now += 800_000_000
    before = flyer.estimate.position
    flyer.step()
    assert flyer.estimate.position == pytest.approx(before, abs=0.1)
    assert hypot(*flyer.velocity) <= 3.0
