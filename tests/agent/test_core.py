from math import hypot

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.pose import Pose
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase


def test_on_the_ground_it_reports_what_it_waits_for(cockpit):
    agent = cockpit(number=2)
    agent.silent = {"pose", "telemetry", "estimate", "nearby"}
    for missing, detail in (
        ("pose", "waits for its own pose"),
        ("telemetry", "waits for telemetry from kinematics"),
        ("estimate", "waits for uav1's estimate"),
        ("nearby", "waits for its nearby bodies"),
    ):
        agent.run(0.1)
        assert (agent.phase, agent.report.detail) == (Phase.GROUNDED, detail)
        agent.silent.remove(missing)
    agent.run(0.1)
    assert (agent.phase, agent.report.detail) == (Phase.READY, "")


def test_a_missing_neighbour_is_named(cockpit):
    agent = cockpit({"graph.edges": [[0, 1], [0, 2], [1, 2], [4, 2], [2, 3], [3, 4]]}, number=2)
    agent.silent = {"uav0", "uav4"}
    agent.run(0.1)
    assert agent.report.detail == "waits for the leader's pose, uav4's estimate"


def test_ages_of_what_never_came_are_minus_one(cockpit):
    report = cockpit().report
    assert (report.pose_age, report.estimate_age, report.nearby_age, report.telemetry_age) == (-1, -1, -1, -1)
    assert report.battery == report.formation_error == -1.0


def test_before_any_pose_it_commands_nothing_and_estimates_nothing(cockpit):
    agent = cockpit()
    agent.silent = {"pose"}
    agent.step()
    assert agent.velocity == (0.0, 0.0, 0.0)
    assert agent.estimate is None


def test_on_the_ground_it_commands_nothing(cockpit):
    agent = cockpit()
    agent.run(0.5)
    assert agent.velocity == (0.0, 0.0, 0.0)


def test_a_weak_battery_does_not_take_off(cockpit):
    agent = cockpit()
    agent.battery = 0.19
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(0.1)
    assert (agent.phase, agent.report.detail) == (Phase.GROUNDED, "battery at 19%, take-off needs 20%")


def test_it_takes_off_straight_up_and_holds(cockpit):
    agent = cockpit()
    agent.run(0.1)
    agent.order("takeoff")
    agent.step()
    assert agent.velocity == (0.0, 0.0, 0.7)
    agent.run(3.0)
    assert agent.phase is Phase.HOLD
    assert agent.position == pytest.approx((3.0, 0.0, 0.95), abs=0.02)


def test_holding_it_comes_back_to_its_place(cockpit):
    agent = cockpit()
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(3.0)
    agent.push((3.4, 0.0, 0.95))
    agent.run(4.0)
    assert agent.position == pytest.approx((3.0, 0.0, 0.95), abs=0.02)


def test_it_lands_where_it_is_on_an_order(cockpit):
    agent = cockpit().fly()
    agent.holds_still = False
    x, y, _ = agent.position
    agent.order("land")
    agent.run(3.0)
    assert agent.phase is Phase.READY
    assert agent.position[:2] == pytest.approx((x, y), abs=0.05)


def test_a_command_answers_its_own_pose(cockpit):
    agent = cockpit().fly()
    seen = agent.now + 3
    agent.core.receive(Key("pose", "uav1"), Pose(seen, "world", agent.position), agent.now + 5)
    messages = dict(agent.core.step(agent.now + 7))
    assert {message.stamp for message in messages.values()} == {seen}


def test_an_unknown_formation_is_not_an_order(cockpit):
    agent = cockpit().fly()
    agent.order("start", agent.now, "heart")
    agent.step()
    assert agent.phase is Phase.FORMATION


def test_another_formation_is_flown_by_its_name(cockpit):
    agent = cockpit({"formations.wide": {"kind": "circle", "radius": 4.0}}).fly()
    assert agent.report.formation_error < 0.02
    agent.order("start", agent.now, "wide")
    agent.step()
    assert agent.report.formation_error > 1.5


def test_the_speed_limit_is_kept(cockpit):
    agent = cockpit({"limits.speed": 1.2}).fly()
    agent.push((9.0, -5.0, 1.0))
    agent.step()
    assert hypot(*agent.velocity) == pytest.approx(1.2)


def test_a_nearby_drone_pushes_away_in_formation_and_in_hold(cockpit):
    agent = cockpit().fly()
    before = agent.velocity
    agent.bodies = (Body(BodyKind.DRONE, (0.3, 0.0, 0.0), 0.0),)
    agent.step()
    assert agent.velocity[0] < before[0] - 0.5
    agent.order("hold")
    agent.step()
    assert agent.velocity[0] < -0.5


def test_a_nearby_obstacle_is_measured_from_its_surface(cockpit):
    agent = cockpit().fly()
    free = agent.velocity
    agent.bodies = (Body(BodyKind.OBSTACLE, (0.0, 0.9, 0.0), 0.3),)
    agent.step()
    assert agent.velocity == pytest.approx(free, abs=0.05)
    agent.bodies = (Body(BodyKind.OBSTACLE, (0.0, 0.6, 0.0), 0.3),)
    agent.step()
    assert agent.velocity[1] < free[1] - 0.5


def test_with_neighbours_sensing_known_neighbours_and_obstacles_push(cockpit):
    changes = {
        "avoidance.sensing": "neighbours",
        "obstacles": [{"center": [5.0, 5.0, 0.0], "radius": 0.2}],
    }
    agent = cockpit(changes)
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(3.0)
    agent.holds_still = True
    agent.order("hold")
    agent.leader = (4.0, 4.0, 1.0)
    agent.push((5.0, 4.5, 1.0))  # 0.3 m from the obstacle
    agent.run(0.5)
    away = agent.velocity
    agent.leader = (5.0, 4.1, 1.0)  # and 0.4 m from the leader
    agent.run(0.5)
    assert agent.velocity[1] > away[1]


def test_two_drones_within_reach_drift_apart(cockpit):
    agent = cockpit()
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(3.0)
    x = agent.position[0]
    agent.bodies = (Body(BodyKind.DRONE, (0.2, 0.0, 0.0), 0.0),)
    agent.run(0.5)
    assert agent.position[0] < x - 0.05


def test_a_restart_in_flight_holds_where_it_is(cockpit):
    agent = cockpit(position=(3.0, -2.0, 1.2))
    agent.state = FlightState.FLYING
    agent.run(1.0)
    assert agent.phase is Phase.HOLD
    assert agent.position == pytest.approx((3.0, -2.0, 1.2), abs=0.01)


@pytest.mark.parametrize("blind", [0.02, 0.5, 3.0])
def test_a_restart_in_flight_that_sees_itself_late_never_flies_elsewhere(cockpit, blind):
    agent = cockpit(position=(3.0, -2.0, 1.2))
    agent.state = FlightState.FLYING
    agent.silent = {"pose"}
    agent.run(blind)
    agent.silent.clear()
    agent.run(2.0)
    assert agent.position[:2] == pytest.approx((3.0, -2.0), abs=0.1)


def test_a_restart_in_flight_does_not_land_before_the_first_pose_could_come(cockpit):
    agent = cockpit(position=(3.0, -2.0, 1.2))
    agent.state = FlightState.FLYING
    agent.silent = {"pose"}
    agent.run(0.05)
    assert agent.phase is Phase.HOLD


def test_a_restart_that_receives_nothing_from_its_driver_leaves_the_drone_to_it(cockpit):
    agent = cockpit(position=(3.0, -2.0, 1.2))
    agent.silent = {"telemetry"}
    agent.run(0.5)
    assert agent.command is None  # a driver that hovers by its commands would never land
    agent.silent.clear()
    agent.state = FlightState.FLYING
    agent.run(0.2)
    assert (agent.phase, agent.velocity) == (Phase.HOLD, (0.0, 0.0, 0.0))


def test_what_it_publishes_never_goes_back_in_time(cockpit):
    """Its receivers turn away what is older than the last."""
    agent = cockpit().fly()
    agent.silent = {"pose"}
    agent.run(0.2)
    said = dict(agent.core.step(agent.now))
    late = Pose(agent.now - 40_000_000, "world", agent.position)  # the first that a slow tracker sends again
    agent.core.receive(Key("pose", "uav1"), late, agent.now)
    for key, message in agent.core.step(agent.now + 1_000_000):
        assert message.stamp >= said[key].stamp


def test_a_tellos_pilot_waits_for_its_own_driver(cockpit):
    agent = cockpit({"drones.1.airframe": "tello"})
    agent.silent = {"telemetry"}
    agent.run(0.1)
    assert agent.report.detail == "waits for telemetry from driver1"
