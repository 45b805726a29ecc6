import pytest


def test_whatever_can_have_a_default_has_one(make_swarm):
    swarm = make_swarm({"leader": None})
    assert swarm.control.rate_hz == 100
    assert swarm.limits.staleness.pose_zero == 0.1
    assert (swarm.network.mode, swarm.network.security) == ("peers", "mtls")
    assert swarm.followers == (1, 2, 3, 4)
    assert swarm.flying == (0, 1, 2, 3, 4)
    assert swarm.airframe(3) == swarm.airframes["kinematics"]


def test_drones_may_stand_in_any_order(make_swarm):
    swarm = make_swarm({"drones": [{"id": i, "start": [float(i), 0.0, 0.0]} for i in (4, 0, 2, 1, 3)]})
    assert swarm.followers == (1, 2, 3, 4)
    assert swarm.drone(2).start == (2.0, 0.0, 0.0)
    with pytest.raises(KeyError):
        swarm.drone(9)


def test_weights_default_to_one(make_swarm):
    swarm = make_swarm({"graph.edges": [[0, 1, 2.5], [1, 2], [2, 3], [3, 4]]})
    assert swarm.topology.neighbours(1) == {0: 2.5}
    assert swarm.topology.neighbours(2) == {1: 1.0}


def test_a_virtual_leader_flies_no_drone(make_swarm):
    swarm = make_swarm({"leader.kind": "virtual", "drones.0": None})
    assert swarm.flying == swarm.followers == (1, 2, 3, 4)
