"""What cores fly by comes from the swarm file, key by key."""

import pytest
from flockwire_core.parameters import agent_parameters, pilot_parameters
from flockwire_core.swarm.laws import BUILT_IN

RATE = {"control.rate_hz": 50}
AIRFRAME = {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}


def test_an_agent_flies_in_its_rank_by_what_its_neighbours_say(make_swarm):
    swarm = make_swarm({**RATE, "graph.edges": [[0, 1], [1, 2], [1, 3, 0.5], [2, 3], [3, 4]]})
    parameters = agent_parameters(swarm, 3)
    assert (parameters.pilot.number, parameters.pilot.period, parameters.rank) == (3, 0.02, 2)
    assert parameters.neighbours == {1: 0.5, 2: 1.0}
    assert parameters.law == BUILT_IN[swarm.control.law]
    assert parameters.settings.number == 3
    assert set(parameters.formations) == set(swarm.formation_names)
    assert parameters.leader_kind == "trajectory"


@pytest.mark.parametrize(("limit", "forward", "fastest"), [(3.0, 0.01, 1.0), (3.0, 0.008, 0.8), (0.7, 0.01, 0.7)])
def test_filter_and_law_of_a_tello_know_what_it_flies_at_full_stick(make_swarm, limit, forward, fastest):
    sticks = {
        "formation.rate": 0.1,
        "airframes.tello": {"stick_gains": {"forward": forward}},
        "drones.1.airframe": "tello",
    }
    swarm = make_swarm({**sticks, "limits.speed": limit, "limits.vertical_speed": 0.5, "control.law": "extended"})
    tello, other = pilot_parameters(swarm, 1), pilot_parameters(swarm, 2)
    assert (tello.speed, other.speed) == (pytest.approx(fastest), limit)
    assert tello.guard.speed == agent_parameters(swarm, 1).settings.speed == tello.speed
