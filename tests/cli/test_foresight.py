"""Flights that must fail: `check` had said so, and when."""

import pytest
from flockwire_cli.foresight import foreseen
from flockwire_recorder.summary import summarise
from flockwire_sim.recording import TraceInMemory
from flockwire_sim.world import World

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


@pytest.fixture
def swarm(make_swarm):
    return lambda changes: make_swarm({**CALM, **changes})


def test_a_course_that_leaves_the_fence(swarm):
    leader, followers = foreseen(swarm(INTO_FENCE), 12.0)
    assert leader == "the leader's course leaves limits.fence after 5.1 s, at [4.0, 0.0, 1.0]"
    assert followers.startswith("formation: the place of uav2 leaves limits.fence after 2.6 s")
    assert not list(foreseen(swarm(INTO_FENCE), 2.0))


def test_the_leader_s_speed_adds_to_the_formation_s(swarm):
    assert "formation: with the leader's speed uav4 needs 4.50 m/s, limits.speed = 3 m/s" in foreseen(
        swarm(TOO_FAST), 3.0
    )


def test_an_obstacle_in_the_leader_s_way(swarm):
    lines = list(foreseen(swarm(INTO_OBSTACLE), 12.0))
    assert "the leader's course comes closer than 0.3 m to obstacle 0 after 2.6 s" in lines


def test_an_obstacle_that_is_lower_than_the_formation_is_in_nobody_s_way(swarm):
    low = {**INTO_OBSTACLE, "obstacles": [{"center": [2.0, 0.0, 0.0], "radius": 0.4, "height": 0.5}]}
    assert not list(foreseen(swarm(low), 6.0))


@pytest.mark.parametrize("changes", [INTO_FENCE, TOO_FAST], ids=["into the fence", "too fast"])
def test_what_was_foreseen_fails(swarm, changes):
    wrong = swarm(changes)
    trace = TraceInMemory(wrong, 0)
    World(wrong, 0, 9.0, (), trace.take).run()
    assert any(sentence.startswith("formation tail: ") for sentence in summarise(trace.trace()).failures())
