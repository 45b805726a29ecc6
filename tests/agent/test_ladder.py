"""Every rung of the staleness ladder, flown."""

from math import dist, hypot

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Leading
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import add
from flockwire_core.pilot.pilot import DRIVER_LOST
from flockwire_core.pilot.reactions import SHUTDOWN
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import APART, LEFT_OUT

TWO = {"graph.edges": [[0, 1], [0, 2], [1, 2], [2, 3], [3, 4]]}
STILL = (0.0, 0.0, 0.0)


@pytest.fixture
def flyer(cockpit):
    """Return agent 2, which receives from the leader and uav1, in formation and on its way."""
    agent = cockpit(TWO, number=2).fly()
    x, y, z = agent.position
    agent.push((x + 0.8, y, z))
    return agent


@pytest.fixture
def third(cockpit):
    """Return agent 3, which receives from uav2 alone, in formation."""
    return cockpit(TWO, number=3).fly()


@pytest.mark.parametrize("without", [(), (2,), (1, 2)])
def test_who_is_left_out_does_not_take_off(cockpit, without):
    agent = cockpit(TWO, number=2)
    agent.run(0.1)
    agent.order("takeoff", without=without)
    agent.run(0.1)
    assert (agent.phase, agent.report.detail) == (
        (Phase.GROUNDED, "left out of this flight") if without else (Phase.TAKEOFF, "")
    )


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


BELOW = (Body(BodyKind.DRONE, (0.1, 0.0, -0.8), 0.0),)


def test_without_its_pose_a_landing_above_another_drone_waits_for_it_as_long(flyer):
    flyer.order("land")
    flyer.run(0.3)
    assert flyer.velocity[2] < -0.5
    flyer.silent, flyer.bodies = {"pose"}, BELOW
    flyer.run(0.12)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, STILL)
    flyer.run(0.87)
    assert flyer.velocity == STILL
    flyer.run(0.02)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))


@pytest.mark.parametrize("place", [(0.1, 0.0, 0.8), (0.6, 0.0, -0.8)], ids=["below it", "beside it"])
def test_without_its_pose_a_landing_with_nobody_below_descends(flyer, place):
    """Who is above descends too, and must not reach it."""
    flyer.order("land")
    flyer.run(0.3)
    flyer.silent, flyer.bodies = {"pose"}, (Body(BodyKind.DRONE, place, 0.0),)
    for _ in range(100):
        flyer.step()
        assert flyer.velocity[2] < -0.5


ABOVE = (Body(BodyKind.DRONE, (0.1, 0.0, 0.8), 0.0),)


def test_without_its_pose_a_drone_beneath_another_descends_at_once_until_its_pose_is_back(flyer):
    """The driver of who is above may have no commands, and land it."""
    flyer.silent, flyer.bodies = {"pose"}, ABOVE
    flyer.run(0.1)
    flyer.step()
    assert (flyer.phase, flyer.velocity) == (Phase.HOLD, (0.0, 0.0, -0.7))
    flyer.silent.clear()
    flyer.step()
    assert flyer.phase is Phase.FORMATION
    assert flyer.velocity[2] > -0.1


def test_without_its_pose_a_take_off_beneath_another_drone_descends_too(cockpit):
    agent = cockpit({"limits.staleness.command_land": 0.5, "limits.staleness.pose_land": 3.0})
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(0.6)
    agent.silent, agent.bodies = {"pose"}, ABOVE
    agent.run(0.12)
    assert (agent.phase, agent.velocity) == (Phase.TAKEOFF, (0.0, 0.0, -0.7))
    agent.silent, agent.bodies = set(), ()
    agent.run(0.1)
    assert (agent.phase, agent.velocity[2]) == (Phase.TAKEOFF, 0.7)


def test_after_a_fast_descent_without_poses_beneath_another_its_own_pose_is_not_taken_for_a_foreign_one(cockpit):
    fast = {"limits.vertical_speed": 2.5, "limits.takeoff_height": 3.5, "limits.fence.max": [4.0, 4.0, 6.0]}
    agent = cockpit(fast | {"control.law": "extended", "limits.staleness.pose_land": 1.5})
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(4.0)
    height = agent.position[2]
    agent.silent, agent.bodies = {"pose"}, ABOVE
    agent.run(1.2)
    assert (agent.phase, agent.velocity) == (Phase.HOLD, (0.0, 0.0, -2.5))
    assert height - agent.position[2] > 2.6
    agent.silent, agent.bodies = set(), ()
    agent.run(0.5)
    assert (agent.phase, agent.report.detail) == (Phase.HOLD, "")
    assert agent.velocity[2] > 0.5  # back to its place, by its own pose


def test_beneath_another_what_pressed_it_down_may_have_ended_with_its_poses(cockpit):
    """The compensation of a downwash would lift it into who is above."""
    agent = cockpit({"control.law": "extended", "control.disturbance": 2.0, "formation.rate": 0.001}).fly()
    agent.holds_still = False
    for _ in range(300):  # 1.2 m/s down beside its commands
        agent.step()
        agent.position = add(agent.position, (0.0, 0.0, -0.012))
    assert agent.velocity[2] > 1.0
    agent.silent, agent.bodies = {"pose"}, ABOVE
    agent.run(0.12)
    for _ in range(80):
        agent.step()
        assert agent.phase is Phase.HOLD
        assert agent.velocity[2] <= -0.35


@pytest.mark.parametrize("place", [(0.45, 0.0, 0.8), (0.1, 0.0, -0.8)], ids=["beside it", "above it"])
def test_without_its_pose_a_drone_that_is_not_beneath_another_hovers(flyer, place):
    flyer.silent, flyer.bodies = {"pose"}, (Body(BodyKind.DRONE, place, 0.0),)
    flyer.run(0.12)
    for _ in range(80):
        flyer.step()
        assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)


@pytest.mark.parametrize(("lands", "pose_land"), [(False, 1.0), (True, 1.0), (True, 0.3)])
def test_without_its_pose_a_drone_between_two_waits_as_long_as_a_driver_without_commands(cockpit, lands, pose_land):
    limits = {"limits.staleness.command_land": 0.5, "limits.staleness.pose_land": pose_land}
    agent = cockpit(limits | {"formation.rate": 0.001}).fly()
    if lands:
        agent.order("land")
        agent.step()
    agent.silent, agent.bodies = {"pose"}, (*ABOVE, *BELOW)
    agent.run(0.12)
    for _ in range(37):
        agent.step()
        assert (agent.phase, agent.velocity) == (Phase.LANDING if lands else Phase.HOLD, STILL)
    agent.run(0.03)
    assert agent.velocity == (0.0, 0.0, -0.7)


def test_by_a_pose_that_is_not_its_own_nobody_knows_whether_it_is_beneath_another(flyer):
    flyer.silent, flyer.bodies = {"pose"}, ()
    flyer.run(0.5)
    flyer.position, flyer.silent, flyer.bodies = add(flyer.position, (5.0, 0.0, 0.0)), set(), ABOVE
    flyer.run(0.1)
    assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)


def test_a_pilot_that_was_frozen_takes_off_only_when_it_has_read_what_waited(cockpit):
    agent = cockpit()
    agent.run(0.1)
    assert agent.phase is Phase.READY
    agent.now += 7 * SECOND
    agent.order("takeoff")
    agent.step()
    assert (agent.phase, agent.report.detail) == (Phase.GROUNDED, "was frozen, reads what waits for it")
    agent.order("land")  # as old, and read later
    agent.run(0.3)
    assert agent.phase is Phase.READY
    agent.order("takeoff")
    agent.run(0.05)
    assert agent.phase is Phase.TAKEOFF


@pytest.mark.parametrize(("seconds", "phase"), [(0.9, Phase.TAKEOFF), (1.1, Phase.LANDING)])
def test_a_pilot_that_was_frozen_as_it_took_off_for_so_long_that_its_driver_landed_it_lands(cockpit, seconds, phase):
    agent = cockpit()
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(0.2)
    agent.now += round(seconds * SECOND)
    agent.step()
    assert agent.phase is phase


@pytest.mark.parametrize("law", ["extended", "paper"])
def test_a_landing_ends_though_its_pose_comes_only_every_now_and_then(cockpit, law):
    agent = cockpit({"control.law": law}).fly()
    agent.holds_still = False
    agent.order("land")
    agent.run(0.2)
    for _ in range(4):
        agent.silent, agent.bodies = {"pose"}, BELOW
        agent.run(0.7)
        agent.silent.clear()
        agent.run(0.02)
    assert agent.phase is Phase.READY


def test_a_landing_does_not_wait_for_poses_that_always_come_late(flyer):
    flyer.order("land")
    flyer.run(0.3)
    flyer.silent, flyer.bodies = {"pose"}, BELOW
    climbing = []
    for _ in range(115):
        pose = Pose(flyer.now - 3 * SECOND // 10, "world", flyer.position)  # as from a clock that is behind
        flyer.core.receive(Key("pose", "uav1"), pose, flyer.now)
        flyer.step()
        climbing.append(flyer.velocity[2])
    assert climbing == [-0.7] * 10 + [0.0] * 90 + [-0.7] * 15


@pytest.mark.parametrize(("silent", "descent"), [(set(), 0.7), ({"pose"}, 0.35)])  # of limits.vertical_speed = 0.7
def test_a_landing_descends_though_the_wind_that_it_compensates_has_ended(cockpit, silent, descent):
    agent = cockpit({"control.law": "extended", "control.disturbance": 2.0, "formation.rate": 0.001}).fly()
    agent.holds_still = False
    for _ in range(200):  # another drone's downwash, 1 m/s
        x, y, z = agent.position
        agent.position = (x, y, z - 0.01)
        agent.step()
    assert agent.velocity[2] > 0.9
    agent.order("land")
    agent.silent = silent
    height, agent.bodies = agent.position[2], BELOW if silent else ()
    agent.run(1.2)
    assert agent.velocity[2] == pytest.approx(-descent, abs=0.1)
    assert agent.position[2] < height
    agent.run(5.0)
    assert agent.phase in (Phase.GROUNDED, Phase.READY)
    agent.run(0.3)
    assert agent.phase in (Phase.GROUNDED, Phase.READY)
    assert agent.velocity[2] <= 0.0  # blind, it does not take off with what it compensated


@pytest.mark.parametrize("law", ["extended", "paper"])
def test_on_the_ground_it_is_not_pushed_along_though_no_telemetry_tells_that_it_is_down(cockpit, law):
    agent = cockpit({"control.law": law, "control.disturbance": 0.0}).fly()
    agent.holds_still = False
    agent.order("land")
    agent.step()
    while agent.position[2] > 0.15:
        agent.step()
    agent.silent = {"telemetry"}
    x, y, _ = agent.position
    agent.bodies = (Body(BodyKind.DRONE, (0.1, 0.0, 0.0), 0.0),)  # no place beside it
    agent.holds_still = True
    agent.push((x + 0.2, y, 0.01))
    agent.run(0.35)
    for _ in range(200):
        agent.step()
        assert (agent.phase, agent.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    agent.push((x + 0.2, y, 0.5))  # in the air it avoids bodies as ever
    agent.run(0.1)
    assert hypot(*agent.velocity[:2]) > 0.1


def test_a_landing_by_the_pose_of_a_body_on_the_ground_ends(cockpit):
    """Its driver says that it flies, its poses that it stands, with no free place near: they are another body's."""
    agent = cockpit({"control.law": "extended"}).fly()
    agent.order("land")
    while agent.position[2] > 0.05:
        agent.holds_still = False
        agent.step()
    agent.holds_still = True
    agent.bodies = (Body(BodyKind.DRONE, (0.1, 0.0, 0.0), 0.0),)
    agent.run(0.5)
    assert hypot(*agent.velocity[:2]) > 0.1
    agent.run(0.8)
    assert (agent.phase, agent.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))


@pytest.mark.parametrize("ends", [0, 30])
def test_a_landing_after_a_side_wind_that_has_ended_stays_over_its_place(cockpit, ends):
    agent = cockpit({"control.law": "extended", "control.disturbance": 2.0, "formation.rate": 0.001}).fly()
    agent.holds_still = False
    for k in range(500):
        if k == 200:
            agent.order("land")
            place = agent.position
        if k < 200 + ends:
            agent.position = add(agent.position, (0.01, 0.0, 0.0))
        agent.step()
    assert agent.phase in (Phase.GROUNDED, Phase.READY)
    assert dist(agent.position[:2], place[:2]) < 0.15


@pytest.mark.parametrize("wind", [-0.6, 0.6])
def test_a_landing_in_a_vertical_wind_touches_down_as_slowly_as_in_calm(cockpit, wind):
    agent = cockpit({"control.law": "extended", "control.disturbance": 2.0, "formation.rate": 0.001}).fly()
    agent.holds_still = False
    heights = []
    for k in range(400):
        x, y, z = agent.position
        agent.position = (x, y, z + 0.01 * wind)
        agent.step()
        if k == 200:
            agent.order("land")
        if agent.phase is Phase.LANDING:
            heights.append(agent.position[2])
    assert agent.phase in (Phase.GROUNDED, Phase.READY)
    assert 100.0 * (heights[-2] - heights[-1]) == pytest.approx(0.7, abs=0.02)


@pytest.mark.parametrize(("disturbance", "drift", "speed"), [(0.0, 0.15, 0.8), (0.3, 0.4, 1.5), (0.0, 1.5, 2.9)])
def test_a_body_that_moves_apart_from_its_commands_hovers_then_lands_straight_down(cockpit, disturbance, drift, speed):
    own = {"control.law": "extended", "formation.rate": 0.001, "limits.body_drift": drift, "limits.speed": 3.0}
    agent = cockpit(own | {"control.disturbance": disturbance}).fly()
    agent.holds_still = False
    for _ in range(250):  # the tracker moves the body, and the pilot flies against it
        assert agent.phase is Phase.FORMATION
        x, y, z = agent.position
        agent.position = (x + 0.01 * speed, y, z)
        agent.step()
        if agent.report.reasons:
            break
    (reason,) = agent.report.reasons
    assert (reason.code, "m/s apart from its commands" in reason.text) == (APART, True)
    agent.holds_still = True
    agent.run(0.15)
    assert (agent.phase, agent.velocity) == (Phase.HOLD, STILL)
    agent.run(1.0)
    agent.holds_still = False
    assert (agent.phase, agent.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    agent.run(2.0)
    assert agent.phase in (Phase.GROUNDED, Phase.READY)
    assert agent.report.reasons == ()


def test_a_drone_whose_commands_do_not_reach_its_driver_is_not_taken_for_another_body(cockpit):
    agent = cockpit({"control.law": "extended", "formation.rate": 0.001, "limits.body_drift": 0.15}).fly()
    agent.command_age = 0.3
    x, y, z = agent.position
    agent.push((x + 0.8, y, z))
    agent.run(5.0)
    assert agent.phase is Phase.FORMATION


def test_two_neighbours_that_disagree_hold_it_until_they_agree(cockpit):
    agent = cockpit(
        {"control.law": "extended", "graph.edges": [[0, 1], [0, 2], [1, 3], [2, 3], [3, 4]]}, number=3
    ).fly()
    agent.beside = {2: (0.5, 0.0, 0.0)}
    agent.run(0.95)
    assert agent.phase is Phase.FORMATION
    agent.run(0.1)
    assert (agent.phase, agent.report.detail) == (
        Phase.HOLD,
        "uav1 and uav2 disagree about the leader by more than 0.3 m",
    )
    agent.beside = {}
    agent.run(0.1)
    assert agent.phase is Phase.FORMATION


def test_a_neighbour_that_contradicts_the_leaders_pose_is_left_out_and_named(cockpit):
    agent = cockpit({**TWO, "control.law": "extended"}, number=2).fly()
    agent.beside = {1: (5.0, 0.0, 0.0)}
    agent.run(1.1)
    assert agent.phase is Phase.FORMATION
    assert agent.estimate.motion.position == pytest.approx(agent.leader, abs=1e-6)
    (reason,) = agent.report.reasons
    assert (reason.code, "uav1" in reason.text, bool(reason.remedy)) == (LEFT_OUT, True, True)
    assert dict(agent.report.counts)["estimates left out"] == 110


def test_when_its_pose_comes_back_in_time_it_continues(flyer):
    flyer.silent = {"pose"}
    flyer.run(0.5)
    flyer.silent.clear()
    flyer.run(0.05)
    assert flyer.phase is Phase.FORMATION


def test_a_silent_neighbour_leaves_the_sum_after_its_time(flyer):
    flyer.run(2.0)
    flyer.silent = {"uav1"}
    flyer.run(0.25)
    settled = flyer.estimate.motion.position
    flyer.leader = (0.0, 0.5, 1.0)  # the leader alone tells so; uav1's last word still counts
    flyer.step()
    flyer.run(0.3)
    flyer.run(2.0)
    assert flyer.phase is Phase.FORMATION
    assert flyer.estimate.motion.position == pytest.approx(flyer.leader, abs=1e-3)
    assert settled == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    assert flyer.report.estimate_age > 2.0


def test_without_any_neighbour_it_holds_and_at_last_lands(flyer):
    flyer.silent = {"uav0", "uav1"}
    flyer.run(1.0)
    assert flyer.phase is Phase.FORMATION
    flyer.run(0.02)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "no leader estimate for 1 s")
    flyer.run(3.97)
    assert flyer.phase is Phase.HOLD
    flyer.run(0.02)
    assert flyer.phase is Phase.LANDING
    assert flyer.report.detail.startswith("leader estimate lost for 5.0 s")


def test_repeated_data_is_not_new_data(third):
    """uav2 publishes at full rate, but nothing newer of the leader than now."""
    third.origin = third.now
    third.run(1.0)
    assert third.phase is Phase.FORMATION
    third.run(0.02)
    assert (third.phase, third.report.detail) == (Phase.HOLD, "no leader estimate for 1 s")
    assert third.report.estimate_age < 0.02
    third.run(4.0)
    assert third.phase is Phase.LANDING


def test_data_that_returns_in_time_is_used_again(third):
    third.origin = third.now
    third.run(2.0)
    third.origin = None
    third.run(0.05)
    assert third.phase is Phase.FORMATION


def test_an_estimate_carries_the_origin_and_the_hops_of_what_it_rests_on(third, flyer):
    third.origin = third.now + 4
    third.step()
    assert (third.estimate.origin, third.estimate.hops) == (third.origin, 2)
    assert (flyer.estimate.origin, flyer.estimate.hops) == (flyer.now, 1)  # from the leader itself


@pytest.mark.parametrize("phase", [Phase.LANDING, Phase.READY, Phase.STOPPED])
def test_a_leader_that_is_down_is_no_longer_followed(flyer, phase):
    flyer.leader_phase = phase
    flyer.step()
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "the leader is down")
    assert flyer.estimate.leading is Leading.IS_DOWN
    flyer.run(4.98)
    assert flyer.phase is Phase.HOLD
    flyer.run(0.05)
    assert flyer.phase is Phase.LANDING
    assert flyer.report.detail.startswith("the leader lost for 5.0 s")


def test_a_leader_that_comes_back_in_time_is_followed_again(flyer):
    flyer.leader_phase = Phase.READY
    flyer.run(4.0)
    flyer.leader_phase = Phase.FORMATION
    flyer.step()
    assert (flyer.phase, flyer.estimate.leading) == (Phase.FORMATION, Leading.LEADS)
    flyer.leader_phase = Phase.READY
    flyer.run(4.0)
    assert flyer.phase is Phase.HOLD  # counted again from its beginning


def test_a_leader_whose_process_is_silent_is_down_though_its_pose_comes(flyer):
    flyer.silent = {"leader"}
    flyer.run(1.0)
    assert flyer.phase is Phase.FORMATION
    flyer.run(0.02)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "the leader is down")


def test_who_does_not_receive_from_the_leader_has_it_from_its_neighbours(third):
    third.leading = Leading.IS_DOWN
    third.step()
    assert (third.phase, third.estimate.leading) == (Phase.HOLD, Leading.IS_DOWN)
    third.run(5.02)
    assert third.phase is Phase.LANDING


def test_while_another_order_holds_a_leader_on_the_ground_lands_no_drone(flyer):
    flyer.order("hold")
    flyer.leader_phase = Phase.READY
    flyer.run(10.0)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "")


def test_a_leader_on_the_ground_blocks_no_take_off(cockpit):
    agent = cockpit(TWO, number=2)
    agent.leader_phase = Phase.READY
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(2.0)
    assert agent.phase is Phase.HOLD


def test_without_neighbours_the_estimate_stays(flyer):
    flyer.silent = {"uav0", "uav1"}
    flyer.run(0.35)
    last = flyer.estimate.motion.position
    flyer.run(1.0)
    assert flyer.estimate.motion.position == last


def test_without_nearby_bodies_it_slows_down_then_holds(flyer):
    flyer.silent = {"nearby"}
    flyer.run(0.1)
    assert hypot(*flyer.velocity) > 0.5
    flyer.step()
    assert flyer.phase is Phase.FORMATION
    assert hypot(*flyer.velocity) == pytest.approx(0.5)
    flyer.run(0.4)
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, "nearby bodies are stale")
    assert hypot(*flyer.velocity) <= 0.5


def test_without_nearby_bodies_it_lands_slowly(cockpit):
    agent = cockpit({"control.law": "extended"}).fly()
    agent.silent = {"nearby"}
    agent.order("land")
    agent.run(1.0)
    assert agent.phase is Phase.LANDING
    assert agent.velocity[2] < 0.0
    assert hypot(*agent.velocity) <= 0.5 + 1e-9


def test_with_neighbours_sensing_no_drone_waits_for_nearby(cockpit):
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


def test_without_telemetry_from_before_the_take_off_it_leaves_the_landing_to_the_driver(cockpit):
    agent = cockpit()
    agent.run(0.1)
    agent.silent = {"telemetry"}
    agent.order("takeoff")
    agent.run(2.0)
    assert (agent.state, agent.phase) == (FlightState.FLYING, Phase.GROUNDED)  # it knows of no take-off
    assert agent.command is not None
    agent.run(1.2)
    assert agent.command is None


@pytest.mark.parametrize(("battery", "phase"), [(0.15, Phase.FORMATION), (0.09, Phase.LANDING)])
def test_a_battery_that_runs_out_lands(flyer, battery, phase):
    flyer.battery = battery
    flyer.step()
    assert flyer.phase is phase


def test_at_the_fence_it_flies_inwards_only(flyer):
    flyer.leader = (30.0, 0.0, 1.0)
    flyer.push((10.2, 0.0, 1.0))
    flyer.run(1.0)
    assert flyer.phase is Phase.FORMATION
    assert flyer.velocity[0] == 0.0
    flyer.leader = (-30.0, 0.0, 1.0)
    flyer.run(30.0)
    assert flyer.velocity[0] < 0.0


def test_beyond_the_fences_margin_it_lands(flyer):
    flyer.push((10.6, 0.0, 1.0))
    flyer.step()
    assert (flyer.phase, flyer.report.detail) == (Phase.LANDING, "0.5 m outside the fence")


def test_a_stop_ends_everything_and_its_driver_gets_no_command_to_hover_by(flyer):
    flyer.stop()
    flyer.order("start", flyer.now)
    flyer.run(0.1)
    assert (flyer.phase, flyer.command) == (Phase.STOPPED, None)
    assert flyer.estimate is not None  # others still fly by it


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


def test_held_in_a_hand_it_is_not_ready_and_does_not_take_off(cockpit):
    agent = cockpit()
    agent.state = FlightState.HELD
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(1.0)
    assert (agent.phase, agent.velocity) == (Phase.GROUNDED, STILL)
    assert "put it down" in agent.report.detail


def test_the_pilot_lands_with_its_driver(flyer):
    flyer.state = FlightState.LANDING
    flyer.step()
    assert (flyer.phase, flyer.report.detail) == (Phase.LANDING, "its driver lands it")


def test_set_down_by_its_driver_on_the_way_up_it_does_not_rise_again(cockpit):
    agent = cockpit()
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(0.5)
    assert agent.phase is Phase.TAKEOFF
    agent.state = FlightState.LANDING
    agent.run(0.5)
    agent.state = FlightState.GROUNDED
    agent.run(0.5)
    assert (agent.phase, agent.velocity) == (Phase.READY, STILL)


def test_a_long_pause_of_the_process_makes_no_jump(flyer):
    flyer.now += 800_000_000
    before = flyer.estimate.motion.position
    flyer.step()
    assert flyer.estimate.motion.position == pytest.approx(before, abs=0.1)
    assert hypot(*flyer.velocity) <= 3.0


def test_asked_to_end_it_holds_for_a_second_then_lands_and_may_end_on_the_ground(flyer):
    flyer.holds_still = False
    flyer.core.retire(flyer.now)
    flyer.step()
    assert (flyer.phase, flyer.report.detail) == (Phase.HOLD, SHUTDOWN)
    assert not flyer.core.may_end(flyer.now)
    flyer.run(0.95)
    assert flyer.phase is Phase.HOLD
    flyer.run(0.1)
    assert (flyer.phase, flyer.report.detail) == (Phase.LANDING, SHUTDOWN)
    flyer.run(2.0)
    assert flyer.state is FlightState.GROUNDED
    assert flyer.core.may_end(flyer.now)


def test_asked_to_end_it_no_longer_takes_off(cockpit):
    agent = cockpit(TWO, number=2)
    agent.run(0.1)
    assert agent.core.may_end(agent.now)
    agent.core.retire(agent.now)
    agent.order("takeoff")
    agent.run(1.0)
    assert (agent.phase, agent.report.detail, agent.state) == (Phase.GROUNDED, SHUTDOWN, FlightState.GROUNDED)


def test_it_does_not_wait_for_a_driver_that_is_long_dead(flyer):
    flyer.silent = {"telemetry"}
    flyer.run(DRIVER_LOST)
    assert not flyer.core.may_end(flyer.now)
    flyer.run(0.1)
    assert flyer.core.may_end(flyer.now)


def test_its_status_names_the_order_that_it_obeys(cockpit):
    agent = cockpit(TWO, number=2)
    assert agent.report.mission is None
    agent.run(0.1)
    agent.order("takeoff")
    agent.step()
    assert agent.report.mission.verb == "takeoff"
    newest = agent.report.mission
    land = newest._replace(stamp=newest.stamp - 1, verb="land", number=0)
    agent.core.receive(MISSION, land, agent.now)
    assert (agent.report.mission.version, agent.report.unnumbered) == (land.version, (land.version,))
    agent.core.receive(MISSION, newest._replace(stamp=newest.stamp + 1, verb="start", number=2), agent.now)
    assert agent.report.mission.version == land.version
