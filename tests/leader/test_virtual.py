from math import dist

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import add
from flockwire_core.swarm.trajectories import trajectory_of
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_leader.grounded import VirtualLeader

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100
VIRTUAL = {"leader": {"kind": "virtual", "start": [1.0, 2.0, 1.5], "trajectory": {"kind": "circle"}}, "drones.0": None}


def place(leader, now):
    ((key, pose),) = leader.step(now)
    assert key == Key("pose", "uav0")
    assert pose.stamp == now
    return pose.position


def test_a_virtual_leader_rests_at_its_start_until_the_mission_starts(make_swarm):
    leader = VirtualLeader(make_swarm(VIRTUAL), 0, BEGAN)
    assert place(leader, BEGAN) == (1.0, 2.0, 1.5)
    leader.receive(MISSION, Mission(BEGAN, "world", "start", BEGAN + SECOND, number=1), BEGAN)
    assert place(leader, BEGAN + SECOND) == (1.0, 2.0, 1.5)
    assert leader.report(BEGAN + SECOND).phase is Phase.READY
    expected = add((1.0, 2.0, 1.5), trajectory_of(make_swarm(VIRTUAL).leader).position(3.0))
    assert place(leader, BEGAN + 4 * SECOND) == pytest.approx(expected)
    assert leader.report(BEGAN + 4 * SECOND).phase is Phase.FORMATION


@pytest.mark.parametrize("order", [("hold", 0), ("land", 0), ("start", 40 * SECOND + SECOND // 2)])
def test_a_virtual_leader_never_jumps(make_swarm, order):
    leader = VirtualLeader(make_swarm(VIRTUAL), 0, BEGAN)
    leader.receive(MISSION, Mission(BEGAN, "world", "start", BEGAN, number=1), BEGAN)
    verb, start = order
    now, before = BEGAN + 40 * SECOND, place(leader, BEGAN + 40 * SECOND)
    leader.receive(MISSION, Mission(now, "world", verb, BEGAN + start if start else 0, number=2), now)
    for tick in range(1, 101):
        here = place(leader, now + tick * TICK)
        assert dist(here, before) < 0.01
        before = here
