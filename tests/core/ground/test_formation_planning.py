"""A change of formation is planned, or refused with drone, time and limit."""

import re

import pytest
from flockwire_core.domain.order import Mission, Order
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import distance, norm
from flockwire_core.ground.delivery import ChangeDelivery
from flockwire_core.ground.formation_planning import LEAD_TIME, ChangeRefusedError, plan_change, plan_in_time
from flockwire_core.pilot.orders import flown_formation
from flockwire_core.swarm.trajectories import speed_of
from flockwire_core.wire.plan import Plan

NOW = 1_790_000_100 * SECOND
RUNNING = Mission(NOW - 30 * SECOND, "world", "start", NOW - 20 * SECOND)
FORMATIONS = {
    "control.law": "extended",
    "formations": {
        "row": {"kind": "line", "spacing": 0.8},
        "block": {"kind": "grid", "spacing": 1.0},
        "wide": {"kind": "circle", "radius": 8.0},
        "high": {"kind": "expression", "x": "2*cos(2*pi*i/n)", "y": "2*sin(2*pi*i/n)", "z": "1.6"},
    },
}


@pytest.fixture
def swarm(make_swarm):
    return make_swarm(FORMATIONS)


def refusal(swarm, name, running=RUNNING, **options):
    with pytest.raises(ChangeRefusedError) as refused:
        plan_change(swarm, running, name, NOW, **options)
    return str(refused.value)


def flown(swarm, mission):
    return flown_formation({name: swarm.build_formation(name) for name in swarm.formation_names}, mission)


def sampled(swarm, order):
    """Return the offsets and rates of all followers all along the change and a second more, every 10 ms."""
    shape, begin = flown(swarm, order), (order.change.begin - order.start) / SECOND
    times = [begin - 1.0 + 0.01 * k for k in range(round(100 * (order.change.duration + 2.0)))]
    return [([shape.offset(i, t) for i in range(4)], [shape.offset_rate(i, t) for i in range(4)]) for t in times]


def test_a_change_begins_in_time_and_continues_from_what_is_flown(swarm):
    order = plan_change(swarm, RUNNING, "row", NOW)
    assert (order.verb, order.stamp, order.start, order.formation) == ("formation", NOW, RUNNING.start, "row")
    assert (order.change.begin, order.change.before) == (NOW + LEAD_TIME, "")
    assert order.change.places_before == (0, 1, 2, 3)
    assert sorted(order.change.places) == [0, 1, 2, 3]


@pytest.mark.parametrize("name", ["row", "block"])
def test_it_keeps_to_the_limits_all_along(swarm, name):
    speed = swarm.limits.speed - speed_of(swarm.leader)
    for offsets, rates in sampled(swarm, plan_change(swarm, RUNNING, name, NOW)):
        assert max(map(norm, rates)) <= speed + 0.01
        points = [(0.0, 0.0, 0.0), *offsets]
        gaps = [distance(p, q) for k, p in enumerate(points) for q in points[:k]]
        assert min(gaps) >= swarm.avoidance.drone_safety_distance


def test_the_shortest_duration_is_taken(make_swarm):
    swarm = make_swarm({**FORMATIONS, "limits.speed": 2.5})  # below what sight allows
    shortest = plan_change(swarm, RUNNING, "wide", NOW).change.duration
    assert "limits.speed = 2.5 m/s" in refusal(swarm, "wide", duration=0.9 * shortest)
    assert plan_change(swarm, RUNNING, "wide", NOW, duration=1.5 * shortest).change.duration == 1.5 * shortest


def test_a_slow_airframe_gets_more_time(make_swarm, swarm):
    slow = make_swarm({**FORMATIONS, "airframes.kinematics": {"lag": 0.35, "dead_time": 0.1}})
    durations = [plan_change(each, RUNNING, "wide", NOW).change.duration for each in (swarm, slow)]
    assert durations[1] > 1.2 * durations[0]


def test_a_change_back_begins_from_the_places_that_were_taken(swarm):
    there = plan_change(swarm, RUNNING, "row", NOW)
    later = there.change.begin + 9 * SECOND
    back = plan_change(swarm, there, "", later)
    assert back.change.before == "row"
    assert back.change.places_before == there.change.places
    begin = (back.change.begin - back.start) / SECOND
    for index in range(4):
        assert flown(swarm, back).offset(index, begin) == flown(swarm, there).offset(index, begin)


def test_no_paths_cross_unless_the_file_fixes_places(make_swarm):
    """The ranks of the larger circle are those of the smaller one, half a turn on."""
    turned = {"kind": "expression", "x": "-3*sin(2*pi*i/n)", "y": "-3*cos(2*pi*i/n)"}
    still = {**FORMATIONS, "formation.rate": 0.0, "formations.turned": turned}
    assert plan_change(make_swarm(still), RUNNING, "turned", NOW).change.places == (2, 3, 0, 1)
    fixed = make_swarm({**still, "formations.turned": {**turned, "places": "fixed"}})
    assert re.fullmatch(
        r"uav0 and uav\d would come within 0\.\d\d m of each other \d+\.\d s into the change, must be 0\.43 m or more "
        r"\(avoidance\.drone_safety_distance, and margin\), however long the change takes \(up to 60 s\)",
        refusal(fixed, "turned"),
    )


def test_too_fast_is_refused_with_drone_time_and_limit(swarm):
    line = refusal(swarm, "wide", duration=2.0)
    assert re.fullmatch(
        r"uav[1-4] would be commanded \d\.\d\d m/s \d\.\d s into the change, limits\.speed = 3 m/s leaves 2\.86 m/s "
        r"beside the leader's 0\.14 m/s",
        line,
    )


def test_out_of_the_fence_is_refused_with_drone_time_and_limit(swarm):
    line = refusal(swarm, "wide", leader=(3.0, 0.0, 1.0))
    assert re.fullmatch(
        r"uav\d would be \d\.\d\d m outside limits\.fence \d+\.\d s into the change, "
        r"if the leader continues its course, however long the change takes \(up to 60 s\)",
        line,
    )
    assert plan_change(swarm, RUNNING, "wide", NOW, leader=(0.0, 0.0, 1.0)).formation == "wide"
    assert "outside limits.fence" in refusal(swarm, "high", leader=(0.0, 0.0, 1.5))


def test_a_change_under_way_is_not_changed(swarm):
    order = plan_change(swarm, RUNNING, "row", NOW)
    with pytest.raises(ChangeRefusedError, match=r"the change to formation 'row' takes another \d\.\d s"):
        plan_change(swarm, order, "block", order.change.begin + SECOND // 2)


def test_the_formation_that_is_flown_is_ordered_again_unchanged(swarm):
    held = plan_change(swarm, RUNNING, "row", NOW)._replace(verb="hold")
    again = plan_change(swarm, held, "row", NOW + 20 * SECOND)
    assert again == held._replace(verb="formation", stamp=NOW + 20 * SECOND)


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), 1e9])
def test_a_bad_duration_is_refused(swarm, duration):
    assert refusal(swarm, "row", duration=duration).startswith("--duration = ")


def test_slow_planning_leaves_time_for_the_order_to_arrive(swarm):
    times = iter([0, 3 * SECOND, 4 * SECOND, 7 * SECOND])
    made = ChangeDelivery(Plan(swarm), Order("formation", "row"), 0, NOW)
    made.to_plan = RUNNING
    order = plan_in_time(swarm, made, lambda: NOW + next(times))
    assert order.stamp == NOW + 7 * SECOND
    assert order.change.begin - order.stamp >= 3 * SECOND
