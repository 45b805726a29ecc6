"""What a core is given at its start, and which core each process gets."""

from random import Random

import pytest
from flockwire_agent.core import AgentCore
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Bystander, Ground, Start, make_core
from flockwire_core.wire.keys import Key
from flockwire_leader.core import FlyingLeader
from flockwire_leader.grounded import VirtualLeader
from flockwire_mocap.core import GatewayCore
from flockwire_twins.kinematics.core import KinematicsCore

NOW = 1_790_000_000 * SECOND
VIRTUAL = {"leader.kind": "virtual", "drones.0": None}
CORES = {
    "gateway": GatewayCore,
    "kinematics": KinematicsCore,
    "leader": FlyingLeader,
    "uav1": AgentCore,
    "uav4": AgentCore,
    "recorder": Bystander,
}


def start(plan, identity):
    return Start(plan, identity, NOW, Random(1))


@pytest.mark.parametrize("identity", CORES)
def test_every_process_gets_its_core(make_plan, identity):
    assert type(make_core(start(make_plan(), identity))) is CORES[identity]


def test_a_virtual_leader_is_another_core(make_plan):
    assert type(make_core(start(make_plan(VIRTUAL), "leader"))) is VirtualLeader


@pytest.mark.parametrize("changes", [None, VIRTUAL, {"avoidance.sensing": "neighbours"}])
def test_every_core_publishes_only_keys_of_its_own_and_triggers_on_what_it_receives(make_plan, changes):
    plan = make_plan(changes)
    for identity in plan.started:
        core = make_core(start(plan, identity))
        assert core.period > 0.0
        assert core.triggers <= set(plan.subscribes[identity])
        assert core.prompt <= set(plan.subscribes[identity])
        for k in range(1, 100):
            assert {key for key, _ in core.step(NOW + k * SECOND // 100)} <= set(plan.publishes[identity])


def test_a_start_knows_its_drone(make_plan):
    plan = make_plan()
    assert start(plan, "uav3").drone == 3
    assert start(plan, "leader").drone == 0
    with pytest.raises(ValueError, match="gateway serves no drone"):
        _ = start(plan, "gateway").drone


@pytest.mark.parametrize("changes", [None, VIRTUAL])
def test_on_the_ground_every_process_may_end_when_asked(make_plan, changes):
    plan = make_plan(changes)
    for identity in plan.started:
        core, later = make_core(start(plan, identity)), NOW + 2 * SECOND
        core.step(later)
        core.retire(later)
        assert core.may_end(later), identity


def test_what_flies_nothing_takes_nothing_in_and_publishes_nothing():
    ground = Ground()
    ground.receive(Key("pose", "uav1"), Pose(NOW, "world", (0.0, 0.0, 1.0)), NOW)
    assert (ground.triggers, ground.prompt, ground.step(NOW)) == (frozenset(), frozenset(), ())
