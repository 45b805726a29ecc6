"""A flight without two of its drones: the process of one is dead, the other stands there ready."""

import pytest
from flockwire_analysis.summary import summarise
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.world import EPOCH, World


@pytest.fixture(scope="module")
def flown(make_plan):
    """Fly five drones of which 3 and 4 are left out; return trace and outcome."""
    plan = make_plan({"graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4], [2, 4], [3, 1]]})
    trace = TraceInMemory(plan.swarm, 0)
    world = World(plan.swarm, 0, 8.0, (), trace.take, without=(3, 4))
    dead = world.processes["uav3"]
    world.scheduler.at(EPOCH + SECOND // 4, dead.kill)
    outcome = world.run()
    return trace.trace(), outcome


def test_the_others_neither_wait_for_them_nor_lose_their_places(flown):
    trace, outcome = flown
    assert outcome.failure == ""
    assert outcome.seconds < 14.0
    summary = summarise(trace)
    assert [check.sentence() for check in summary.checks if not check.ok] == []
    assert (summary.drones, summary.left_out) == (3, ("uav3", "uav4"))


def test_a_drone_that_is_left_out_stays_on_the_ground_though_ready(flown):
    trace, _ = flown
    assert set(trace.of("telemetry", 4).values[:, 0]) == {FlightState.GROUNDED}
    assert [state.phase for state in trace.shown["uav4"]][-1] == "grounded"
