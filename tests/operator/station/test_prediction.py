"""Flights that must fail: `check` had said so, and when."""

import re
import tomllib
from pathlib import Path

import pytest
from flockwire_analysis.summary import summarise
from flockwire_core.loading import parse_swarm
from flockwire_core.wire.codec import decode
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Status
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.world import World
from flockwire_operator.station.initial import swarm_text
from flockwire_operator.station.prediction import predicted

CALM = {"control.law": "extended", "formation.rate": 0.1, "leader.input_bound": 1.0}
INTO_FENCE = {
    "leader.trajectory.velocity": [0.8, 0.0, 0.0],
    "limits.fence.min": [-4.0, -4.0, -0.5],
    "limits.fence.max": [4.0, 4.0, 3.0],
}
TOO_FAST = {"leader.trajectory.velocity": [2.5, 0.0, 0.0], "formation.rate": 1.0}
INTO_OBSTACLE = {
    "leader.trajectory.velocity": [0.5, 0.0, 0.0],
    "obstacles": [{"center": [2.0, 0.0, 0.0], "radius": 0.4}],
}


def laid_out_in_readme():
    """Return README's swarm of your own."""
    text = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
    return re.search(r"## Your own swarm\n\n```toml\n(.*?)```", text, re.DOTALL)[1]


@pytest.fixture
def swarm(make_swarm):
    return lambda changes: make_swarm({**CALM, **changes})


def test_a_course_that_leaves_the_fence(swarm):
    leader, followers = predicted(swarm(INTO_FENCE), 12.0)
    assert leader == "the leader's course leaves limits.fence after 5.1 s, at [4.0, 0.0, 1.0]"
    assert followers.startswith("formation: the place of uav2 leaves limits.fence after 2.6 s")
    assert not list(predicted(swarm(INTO_FENCE), 2.0))


def test_nobody_knows_before_a_flight_who_gets_a_place_of_an_auction(swarm):
    auction = {"formation.assignment": "auction", "graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]}
    _, followers = predicted(swarm({**INTO_FENCE, **auction}), 12.0)
    assert followers.startswith("formation: the place of whoever gets place 1 leaves limits.fence after 2.6 s")


def test_a_flight_without_an_end_leaves_the_fence_some_day(swarm):
    slow = {**INTO_FENCE, "leader.trajectory.velocity": [0.01, 0.0, 0.0]}
    assert not list(predicted(swarm(slow), 60.0))
    leader, _ = predicted(swarm(slow), 0.0)
    assert leader.startswith("the leader's course leaves limits.fence after 40")


def test_the_default_leader_and_those_of_the_first_files_stay_inside():
    table = tomllib.loads(laid_out_in_readme())
    for made in (
        table,
        tomllib.loads(swarm_text("five", 5, ideal=False)),
        tomllib.loads(swarm_text("twenty", 20, ideal=True)),
    ):
        assert not list(predicted(parse_swarm(made, "test.toml"), 0.0))


def test_what_keeps_a_leader_and_the_others_off_their_places_at_the_fence_is_in_their_rows(swarm):
    """Fly into a fence: what the statuses report in the end."""
    stuck = swarm({**INTO_FENCE, "control.law": "extended", "checks.off_place": 2.0})
    details = {}

    def take(published):
        if published.key.kind == "status":
            report = decode(Status, published.sample.payload).report
            if report.phase == Phase.FORMATION:
                details[published.key.owner] = report.line

    World(stuck, 0, 16.0, (), take).run()
    assert details["leader"] == "its place is outside the fence"
    assert any("its place is outside the fence" in detail for owner, detail in details.items() if owner != "leader")


def test_the_leader_s_speed_adds_to_the_formation_s(swarm):
    assert "formation: with the leader's speed uav4 needs 4.50 m/s, limits.speed = 3 m/s" in predicted(
        swarm(TOO_FAST), 3.0
    )


def test_an_obstacle_that_followers_fly_around_is_left_out_on_request(swarm):
    every, needed = (set(predicted(swarm(INTO_OBSTACLE), 12.0, avoided=avoided)) for avoided in (True, False))
    (left_out,) = every - needed
    assert left_out.startswith("formation: obstacle 0 is at the place of ")


def test_an_obstacle_in_the_leader_s_way(swarm):
    lines = list(predicted(swarm(INTO_OBSTACLE), 12.0))
    assert "the leader's course comes closer than 0.3 m to obstacle 0 after 2.6 s" in lines


def test_an_obstacle_that_is_lower_than_the_formation_is_in_nobody_s_way(swarm):
    low = {**INTO_OBSTACLE, "obstacles": [{"center": [2.0, 0.0, 0.0], "radius": 0.4, "height": 0.5}]}
    assert not list(predicted(swarm(low), 6.0))


@pytest.mark.parametrize(
    ("changes", "check"),
    [
        pytest.param(INTO_FENCE, "places", id="into the fence"),
        pytest.param(TOO_FAST, "formation tail", id="too fast", marks=pytest.mark.long),
    ],
)
def test_what_was_predicted_fails(swarm, changes, check):
    wrong = swarm(changes)
    trace = TraceInMemory(wrong, 0)
    World(wrong, 0, 9.0, (), trace.take).run()
    assert any(sentence.startswith(f"{check}: ") for sentence in summarise(trace.trace()).failures())


REAL = {
    "control.law": "extended",
    "gateway.source": "natnet",
    "drones": [
        {"id": 0, "start": [0.0, 0.0, 0.0]},
        {"id": 1, "start": [2.0, 0.0, 0.0], "airframe": "tello", "tello": {"address": "192.168.10.1"}},
    ],
    "graph.edges": [[0, 1]],
}
ROOM = {"limits.fence": {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (ROOM, []),
        ({}, ["limits.fence is the default, 20 x 20 x 3.5 m, for real drones (uav1)"]),
        (ROOM | {"control.safety_filter": False}, ["control.safety_filter: real drones (uav1) fly without it"]),
    ],
)
def test_what_real_drones_fly_without_is_named(make_swarm, changes, said):
    swarm = make_swarm({**REAL, **changes})
    named = [line for line in predicted(swarm, 20.0) if "real drones" in line]
    assert len(named) == len(said)
    assert all(line.startswith(one) for line, one in zip(named, said, strict=True))
    assert not [line for line in predicted(swarm.in_simulation(), 20.0) if "real drones" in line]


def test_a_flight_that_ends_before_its_take_off_is_named(make_swarm):
    high = make_swarm({"limits.takeoff_height": 25.0, "limits.fence": {"ceiling": 60.0}})
    assert "--duration = 15 s: the take-off alone takes 36 s" in "\n".join(predicted(high, 15.0))
    assert "take-off alone" not in "\n".join(predicted(high, 40.0))


def test_places_that_meet_beyond_the_survey_are_named(make_swarm):
    """The second rank reaches the first one's place after five minutes."""
    late = {"control.law": "extended", "formation": {"kind": "expression", "x": "2 + i*(2 - t/150)", "y": "0"}}
    swarm = make_swarm({**late, "leader.trajectory.velocity": [0.0, 0.0, 0.0]})
    assert "come within" not in "\n".join(predicted(swarm, 200.0))
    assert "formation: its drones come within" in "\n".join(predicted(swarm, 310.0))
