from ipaddress import IPv4Network

import pytest
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.wording import InputError
from flockwire_deploy.compose import POOL, aboard, networks


def ring(count):
    """Return a swarm of `count` followers, each of whom receives from two before it."""
    drones = [{"id": i, "start": [3.0 * (i % 10), 3.0 * (i // 10), 0.0]} for i in range(count + 1)]
    edges = [[0, 1], [1, 2], *([i - j, i] for i in range(3, count + 1) for j in (1, 2))]
    wide = {"limits.fence.min": [-99.0, -99.0, -1.0], "limits.fence.max": [99.0, 99.0, 3.0], "formation.radius": 9.0}
    return {"drones": drones, "graph.edges": edges, **wide, "limits.speed": 9.0}


@pytest.mark.parametrize("changes", [{}, {"network.mode": "router"}, {"avoidance.sensing": "neighbours"}])
def test_linked_processes_share_a_network_and_gateways_share_none_with_others(make_plan, changes):
    plan = make_plan(changes)
    nets = networks(plan)
    for one in aboard(plan):
        for other in set(plan.links[one]).intersection(aboard(plan)):
            assert any({one, other} <= set(net.members) for net in nets)
    drones = {identity for identity, member in plan.members.items() if member.drone is not None}
    for net in nets:
        if drones.issuperset(net.members):
            one, other = net.members
            assert other in plan.links[one]


def test_each_edge_of_the_graph_has_a_network_of_its_own(make_plan):
    plan = make_plan()
    names = {drone: uav(drone) for drone in plan.swarm.followers} | {0: plan.pilot[0]}
    edges = {f"{names[source]}-{names[target]}" for source, target, _ in plan.swarm.graph.edges}
    assert edges <= {net.name for net in networks(plan)}
    assert len(edges) == 4


def test_every_other_process_has_one_network_with_all_linked_to_it(make_plan):
    plan = make_plan()
    shared = {net.name: set(net.members) for net in networks(plan)}
    assert shared["gateway"] == {"gateway", *plan.links["gateway"]} & set(aboard(plan))


def test_an_engine_chooses_addresses_of_few_networks_and_of_many_gets_them(make_plan):
    assert {net.subnet for net in networks(make_plan())} == {None}
    plan = make_plan(ring(20))
    nets = networks(plan)
    assert len(nets) > POOL
    subnets = [net.subnet for net in nets]
    assert len(set(subnets)) == len(nets)
    for net, subnet in zip(nets, subnets, strict=True):
        assert subnet.num_addresses >= len(net.members) + 3
    assert not any(one.overlaps(other) for i, one in enumerate(subnets) for other in subnets[:i])


def test_a_range_that_is_named_is_used_and_one_too_small_refused(make_plan):
    within = IPv4Network("192.168.0.0/20")
    assert all(net.subnet.subnet_of(within) for net in networks(make_plan(), within))
    with pytest.raises(InputError, match=r"--subnets = 192.168.0.0/26: has no room for 8 networks of 13 addresses"):
        networks(make_plan(), IPv4Network("192.168.0.0/26"))
    with pytest.raises(InputError, match="has no room"):
        networks(make_plan(), IPv4Network("192.168.0.0/30"))
