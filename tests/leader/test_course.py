"""The course: mission time while nothing hinders, waiting without a jump, and the way round what is in the way."""

from __future__ import annotations

from collections.abc import Callable
from math import dist, exp, hypot, sin
from typing import Any

import pytest
from flockwire_core.control.airframe.disturbance import DisturbedAirframe
from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, add, scale, subtract
from flockwire_core.swarm.trajectories import trajectory_of
from flockwire_core.wire.phase import Phase
from flockwire_leader.course import CATCH_UP, SLACK, Course
from hypothesis import given
from hypothesis import strategies as st

FREE = {"control.law": "extended"}
ACCELERATION = 10.0  # m/s^2, the default
small = st.floats(-0.05, 0.05)


def at(position: Vector, stopping: Vector | None = None) -> Motion:
    return Motion(position, ZERO, position if stopping is None else stopping)


def leg(length: float = 2.0) -> dict[str, Any]:
    return {"leader.trajectory": {"kind": "waypoints", "points": [[length, 0.0, 0.0]], "speed": 0.3}}


@given(t=st.floats(0.0, 300.0), error=st.tuples(small, small, small))
def test_while_nothing_hinders_its_time_is_exactly_mission_time(
    make_swarm: Callable[..., Any], t: float, error: Vector
) -> None:
    swarm = make_swarm({**FREE, "leader.trajectory": {"kind": "circle"}})
    course, way = Course(swarm, 0), trajectory_of(swarm.leader)
    course.restart((1.0, 2.0, 1.0), 0.0)
    course.time.restart(t)  # it was asked without a pause
    there = add((1.0, 2.0, 1.0), way.position(t))
    position = subtract(there, error)
    correction = scale(subtract(add(subtract((1.0, 2.0, 1.0), way.position(0.0)), way.position(t)), position), 2.0)
    assert course.velocity(at(position), (), t, t) == add(way.rate(t), correction)


@pytest.mark.parametrize("airframe", [{}, {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}])
@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_neither_corners_nor_lag_make_it_wait(fly: Any, airframe: dict[str, Any], speed: float) -> None:
    """There and back, at once."""
    way = {"kind": "waypoints", "points": [[2.0 * speed, 0.0, 0.0], [0.0, 0.0, 0.0], [speed, 0.0, 0.0]], "speed": speed}
    reached = fly({**FREE, **airframe, "leader.trajectory": way}, 8.0)
    assert reached[3.5] == pytest.approx(0.5 * speed, abs=0.02 + 0.05 * speed)  # 1.5 s after the first corner


@pytest.fixture
def fly(make_swarm: Callable[..., Any]) -> Callable[..., dict[float, float]]:
    """Fly the course with a simulated airframe; returns x, m, at the tenths of a second."""

    def run(changes: dict[str, Any], duration: float) -> dict[float, float]:
        swarm = make_swarm(changes)
        frame, course = swarm.airframe(0), Course(swarm, 0)
        course.restart((0.0, 0.0, 1.0), 0.0)
        position, velocity, sent, reached = (0.0, 0.0, 1.0), ZERO, [ZERO] * 200, {}
        for k in range(round(100 * duration)):
            reached[round(k / 100, 2)] = position[0]
            coming = sent[len(sent) - round(100 * frame.dead_time) :]
            stopping = add(position, scale(velocity, frame.lag))
            for command in coming:
                stopping = add(stopping, scale(command, 0.01))
            sent.append(course.velocity(at(position, stopping), (), k / 100, k / 100))
            delayed = sent[-1 - round(100 * frame.dead_time)]
            velocity = add(delayed, scale(subtract(velocity, delayed), exp(-0.01 / frame.lag) if frame.lag else 0.0))
            position = add(position, scale(velocity, 0.01))
        assert course.time.waited == 0.0
        return reached

    return run


def test_held_back_the_trajectory_waits_and_continues_without_a_jump(flying: Callable[..., Any]) -> None:
    leader = flying(leg())
    start = subtract(leader.position, (0.9, 0.0, 0.0))
    leader.stuck = True
    leader.run(20.0)
    assert hypot(*leader.velocity) <= 0.3 + CATCH_UP
    leader.stuck, leader.fastest = False, 0.0
    before = leader.velocity
    for _ in range(800):
        leader.step()
        assert dist(leader.velocity, before) <= ACCELERATION / 100 + 1e-9
        assert leader.velocity[0] > -0.01  # never backwards
        before = leader.velocity
    assert leader.position == pytest.approx(add(start, (2.0, 0.0, 0.0)), abs=0.02)


def test_the_goal_stops_within_reach_of_a_leader_that_is_stuck(make_swarm: Callable[..., Any]) -> None:
    course = Course(make_swarm({**FREE, **leg()}), 0)
    course.restart((0.0, 0.0, 1.0), 0.0)
    steps, pace = [], 1.0
    for k in range(1, 1000):
        course.velocity(at((0.0, 0.0, 1.0)), (), k / 100, k / 100)
        steps.append(abs(course.time.pace - pace))
        pace = course.time.pace
    assert pace < 0.01
    assert max(steps) <= 0.01 / 0.25 + 1e-12
    assert 0.3 * (10.0 - course.time.waited) < 0.15 + SLACK


def test_a_goal_that_lies_in_an_obstacle_continues_and_waits_behind_it(make_swarm: Callable[..., Any]) -> None:
    course = Course(make_swarm({**FREE, **leg(9.0)}), 0)
    course.restart((0.0, 0.0, 1.0), 0.0)
    ahead = Body(BodyKind.OBSTACLE, (0.7, 0.0, 0.0), 0.3)  # 0.33 m round it nobody may be
    for k in range(1, 2000):
        course.velocity(at((0.0, 0.0, 1.0)), (ahead,), k / 100, k / 100)
    assert 1.33 < 0.3 * (20.0 - course.time.waited) < 1.6


@pytest.mark.parametrize("aside", [-0.2, 0.0, 0.2])
def test_it_gets_round_an_obstacle_on_its_path_and_reaches_the_end(flying: Callable[..., Any], aside: float) -> None:
    leader = flying(leg(4.0))
    start = subtract(leader.position, (0.9, 0.0, 0.0))
    leader.obstacles = [(add(start, (2.2, aside, 0.0)), 0.4)]
    leader.run(25.0)
    assert leader.clearance >= 0.3
    assert leader.jump <= ACCELERATION / 100 + 1e-9
    assert leader.position == pytest.approx(add(start, (4.0, 0.0, 0.0)), abs=0.02)


def test_on_the_wrong_side_it_tries_the_other_one(flying: Callable[..., Any]) -> None:
    """A row of obstacles to its right: the way round is to the left."""
    leader = flying(leg(4.0))
    start = subtract(leader.position, (0.9, 0.0, 0.0))
    leader.obstacles = [(add(start, (2.2, -0.6 * k, 0.0)), 0.3) for k in range(10)]
    leader.run(60.0)
    assert leader.clearance >= 0.3
    assert leader.position == pytest.approx(add(start, (4.0, 0.0, 0.0)), abs=0.02)


def test_during_a_hold_of_the_ladder_the_trajectory_waits(flying: Callable[..., Any]) -> None:
    leader = flying(leg())
    start = subtract(leader.position, (0.9, 0.0, 0.0))
    leader.silent = {"nearby"}
    leader.run(4.0)
    assert leader.phase is Phase.HOLD
    leader.silent, leader.jump = set(), 0.0
    leader.run(8.0)
    assert leader.jump <= ACCELERATION / 100 + 1e-9
    assert leader.position == pytest.approx(add(start, (2.0, 0.0, 0.0)), abs=0.05)


@pytest.mark.parametrize("verbs", [("hold", "start"), ("start",)])
def test_new_orders_make_it_restart_from_where_it_is(flying: Callable[..., Any], verbs: tuple[str, ...]) -> None:
    leader = flying(leg())
    for verb in verbs:
        leader.order(verb)
        leader.run(1.0)
    assert leader.jump <= ACCELERATION / 100 + 1e-9
    assert leader.fastest <= 0.4
    begin = subtract(leader.position, (0.3, 0.0, 0.0))
    leader.run(8.0)
    assert leader.position == pytest.approx(add(begin, (2.0, 0.0, 0.0)), abs=0.03)


def test_a_hold_is_no_time_in_which_its_bend_grows(make_swarm: Callable[..., Any]) -> None:
    course, position, away = Course(make_swarm(FREE | leg()), 0), (0.0, 0.0, 1.0), 0.0
    course.restart(position, 0.0)
    for begin in (0.0, 30.0):  # a person passes, the leader holds, another person passes
        if begin:
            course.resume(position, begin)
        x = position[0]
        for step in range(100):
            person = Body(BodyKind.MOVER, subtract((x + 1.2 - 0.008 * step, 0.1, 1.0), position), 0.3, (-0.4, 0.0, 0.0))
            now = begin + 0.02 * step
            position = add(position, scale(course.velocity(at(position), [person], now, now), 0.02))
            away = max(away, abs(position[1]))
    assert 0.1 < away < 1.0


@pytest.mark.parametrize("aside", [-0.3, 0.05, 0.3])
def test_it_leaves_the_way_of_a_person_early_and_comes_back(flying: Callable[..., Any], aside: float) -> None:
    """With the bent goal alone it was 0.3 m beside the way's middle when the person was 1.3 m away."""
    still = {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}
    leader = flying({"leader.trajectory": still, "limits.speed": 1.5, "avoidance.sensing_radius": 3.0})
    x, y, _ = place = leader.position
    leader.persons = [((x - 2.8, y - aside, 0.0), (1.0, 0.0, 0.0))]
    leader.run(1.5)
    assert abs(leader.position[1] - y + aside) > 0.45
    leader.run(4.0)
    assert leader.position == pytest.approx(place, abs=0.01)


def test_a_new_flight_begins_without_the_bend_of_the_last_one(make_swarm: Callable[..., Any]) -> None:
    course, position = Course(make_swarm(FREE | leg()), 0), (0.0, 0.0, 1.0)
    course.restart(position, 0.0)
    person = Body(BodyKind.MOVER, (0.8, 0.1, 0.0), 0.3, (-0.4, 0.0, 0.0))
    for step in range(50):
        bent = course.velocity(at(position), [person], 0.02 * step, 0.02 * step)
    assert abs(bent[1]) > 0.05
    course.restart(position, 0.0)
    assert course.velocity(at(position), (), 0.01, 1.0) == pytest.approx((0.306, 0.0, 0.0))


def test_a_stopping_point_is_led_with_the_goal_of_when_the_drone_would_stop(make_swarm: Callable[..., Any]) -> None:
    """On a circle: the stopping point is lag and dead time ahead of the drone."""
    tello = {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}
    swarm = make_swarm({**FREE, **tello, "leader.trajectory": {"kind": "circle", "radius": 0.5, "rate": 0.4}})
    course, way = Course(swarm, 0), trajectory_of(swarm.leader)
    course.restart(way.position(0.0), 0.0)
    for t in (0.0, 0.05, 0.1):
        ahead = way.position(t + 0.35)
        assert dist(course.velocity(at(way.position(t), ahead), (), t, t), way.rate(t + 0.35)) < 1e-9
        behind = course.velocity(at(way.position(t), subtract(ahead, (0.1, 0.0, 0.0))), (), t, t)
        assert dist(behind, add(way.rate(t + 0.35), (0.2, 0.0, 0.0))) < 1e-9


@pytest.mark.parametrize(("behind", "waits"), [(0.1, False), (0.6, True)])
def test_the_trajectory_waits_for_the_stopping_point_where_a_wind_holds_the_position_back(
    make_swarm: Callable[..., Any], behind: float, waits: bool
) -> None:
    tello = {"control.law": "extended", "airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}
    straight = {"kind": "constant", "velocity": [0.1, 0.0, 0.0]}
    course = Course(make_swarm({**FREE, **tello, "leader.trajectory": straight}), 0)
    course.restart((0.0, 0.0, 1.0), 0.0)
    for k in range(100):
        t = 0.01 * k
        course.velocity(at((0.1 * t - 0.6, 0.0, 1.0), (0.1 * (t + 0.35) - behind, 0.0, 1.0)), (), t, t)
    assert (course.time.pace < 0.5) == waits


def test_a_leader_in_wind_with_a_wrong_airframe_stays_on_its_course(fly_leader_in_wind: Any) -> None:
    """Weak and slow by 30 %, in a wind that swings once in three seconds."""
    assert fly_leader_in_wind() < 0.025


@pytest.fixture
def fly_leader_in_wind(make_swarm: Callable[..., Any]) -> Callable[[], float]:
    def run() -> float:
        tello = {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}
        swarm = make_swarm({**FREE, **tello, "leader.trajectory": {"kind": "circle", "radius": 0.5, "rate": 0.4}})
        course, way = Course(swarm, 0), trajectory_of(swarm.leader)
        x = way.position(0.0)
        course.restart(x, 0.0)
        state, v, sent, errors = DisturbedAirframe(0.25, 0.1, 2.0, 6.0), ZERO, [ZERO] * 14, []
        for k in range(3000):
            t = k / 100
            motion = state.measure(x, t, t)
            sent.append(state.command(course.velocity(motion, (), t, t), t))
            wind = (0.04 * sin(2.1 * t), 0.0, 0.0)
            x, v = lagged_motion(x, v, add(scale(sent[-14], 0.7), wind), 0.325, 0.01)
            if t > 15.0:
                errors.append(dist(x, way.position(t + 0.01)))
        return max(errors)

    return run
