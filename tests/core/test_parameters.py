"""What cores fly by comes from the swarm file, key by key."""

import pytest
from flockwire_core.parameters import law_settings, pilot_parameters


@pytest.mark.parametrize(("limit", "forward", "fastest"), [(3.0, 0.01, 1.0), (3.0, 0.008, 0.8), (0.7, 0.01, 0.7)])
def test_filter_and_law_of_a_tello_know_what_it_flies_at_full_stick(make_swarm, limit, forward, fastest):
    sticks = {
        "formation.rate": 0.1,
        "airframes.tello": {"stick_gains": {"forward": forward}},
        "drones.1.airframe": "tello",
    }
    swarm = make_swarm({**sticks, "limits.speed": limit, "limits.vertical_speed": 0.5, "control.law": "extended"})
    tello, other = pilot_parameters(swarm, 1), pilot_parameters(swarm, 2)
    assert (tello.guard.speed, other.guard.speed) == (pytest.approx(fastest), limit)
    assert law_settings(swarm, 1).speed == tello.guard.speed
