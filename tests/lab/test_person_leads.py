"""A person carries the leader in virtual time: the formation goes along, and nobody flies or awaits the body."""

import numpy as np
import pytest
from flockwire_analysis.summary import summarise
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.world import World

WALK = {"kind": "waypoints", "points": [[1.5, 0.0, 0.0], [1.5, 1.5, 0.0]], "speed": 0.4}
PERSON = {
    "leader": {"kind": "tracked", "speed": 0.5, "trajectory": WALK}, "drones.0.start": [0.0, 0.0, 1.2],
    "control.law": "extended", "avoidance.sensing_radius": 2.5, "gateway": {"noise": 0.001},
}  # fmt: skip


@pytest.fixture(scope="module")
def trace(make_swarm):
    """Return the trace of a flight that ended well."""
    swarm = make_swarm(PERSON)
    memory = TraceInMemory(swarm, 0, ())
    assert World(swarm, 0, 12.0, (), memory.take).run().failure == ""
    return memory.trace()


def test_the_formation_goes_round_the_person_and_passes_all_checks(trace):
    summary = summarise(trace)
    assert summary.failures() == ()
    assert summary.drones == 4
    assert 0.3 <= summary.min_distance_obstacle_m < 2.0  # from the person
    places = trace.of("truth", 0).values
    assert places[0] == pytest.approx((0.0, 0.0, 1.2))
    assert places[-1] == pytest.approx((1.5, 1.5, 1.2))


def test_the_person_stands_until_the_order_to_start(trace):
    start = next(mission.start for mission in trace.missions if mission.in_formation)
    truth = trace.of("truth", 0)
    left = truth.stamps[np.hypot(truth.values[:, 0], truth.values[:, 1]) > 0.01]
    assert 0.0 < (left[0] - start) / SECOND < 0.1


def test_no_process_commands_or_waits_for_the_person(trace):
    assert 0 not in trace.plan.pilots
    assert 0 not in trace.flying
    assert not {Key("command", "uav0"), Key("telemetry", "uav0")}.intersection(trace.plan.keys)
    assert [state.phase for state in trace.shown["leader"]][-1] == "tracked"
    assert {"take-off", "formation", "landing"} <= {state.phase for state in trace.shown["uav4"]}


def test_a_person_out_of_sight_makes_the_drones_hold_and_the_leader_reports_it(fly):
    hidden = {"kind": "tracker", "at": 5.0, "drone": 0, "duration": 3.0}
    flight = fly(PERSON, hidden, duration=11.0)
    assert flight.outcome.failure == ""
    assert "pose lost" in [phase for t, phase, _ in flight.phases("leader", 5.0) if t < 8.0]
    for drone in ("uav1", "uav4"):
        assert [phase for t, phase, _ in flight.phases(drone, 4.0) if t < 10.0] == ["formation", "hold", "formation"]
