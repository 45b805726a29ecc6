import pytest
from flockwire_core.swarm.model import uav
from flockwire_core.wire import processes
from flockwire_core.wire.keys import MISSION, STOP, Key
from flockwire_core.wire.plan import Plan
from hypothesis import given, settings
from hypothesis import strategies as st
from table_rows import table_rows

ROUTER = "router"
TWO_HOSTS = {
    "hosts": {
        "ground": {"address": "10.0.0.1", "processes": ["gateway"]},
        "air": {"address": "fe80::1", "processes": ["leader", "recorder"]},
    },
    "drones.2.host": "air",
    "drones.3.address": "10.0.0.7:9000",
}
VIRTUAL = {"leader.kind": "virtual", "drones.0": None}


def own_inputs(swarm, i):
    """Return what agent i may receive by the paper: itself, its in-neighbours, and the orders."""
    keys = {Key("pose", uav(i)), Key("telemetry", uav(i)), MISSION, STOP}
    neighbours = swarm.topology.neighbours(i)
    keys |= {Key("estimate", uav(j)) for j in neighbours if j} | {Key("pose", "uav0") for j in neighbours if not j}
    keys |= {Key("status", "leader")} if 0 in neighbours else set()  # whether it leads
    if swarm.avoidance.sensing == "nearby":
        return keys | {Key("nearby", uav(i))}
    return keys | {Key("pose", uav(j)) for j in neighbours}


@settings(max_examples=25)
@given(data=st.data())
def test_an_agent_subscribes_to_its_own_and_its_neighbours_keys_alone(plans, data):
    plan = data.draw(plans)
    for i in plan.swarm.followers:
        assert set(plan.subscribes[uav(i)]) == own_inputs(plan.swarm, i)
        assert set(plan.publishes[uav(i)]) == {Key(kind, uav(i)) for kind in ("estimate", "command", "status", "batch")}


@settings(max_examples=25)
@given(data=st.data())
def test_the_flows_are_the_key_table_with_the_recorder_on_every_key_or_its_batch(plans, data):
    plan = data.draw(plans)
    assert [(key, set(senders), set(receivers)) for key, senders, receivers in plan.flows] == list(
        table_rows(plan.swarm)
    )
    assert plan.keys == tuple(key for key, _, _ in plan.flows)


@settings(max_examples=25)
@given(data=st.data())
def test_links_are_symmetric_and_each_is_dialled_by_one_side(plans, data):
    plan = data.draw(plans)
    for one, others in plan.links.items():
        assert one not in others
        assert set(plan.dials[one]) <= set(others)
        for other in others:
            assert one in plan.links[other]
            assert (other in plan.dials[one]) + (one in plan.dials[other]) == 1


@settings(max_examples=25)
@given(data=st.data())
def test_whoever_is_dialled_listens(plans, data):
    plan = data.draw(plans)
    assert {other for dialled in plan.dials.values() for other in dialled} <= set(plan.endpoints)


@settings(max_examples=25)
@given(data=st.data())
def test_every_key_finds_its_way_over_the_links(plans, data):
    plan = data.draw(plans)
    for key, publishers, subscribers in table_rows(plan.swarm):
        for publisher in publishers:
            assert key in plan.publishes[publisher]
            for subscriber in subscribers - {publisher}:
                assert key in plan.subscribes[subscriber]
                assert subscriber in plan.partners[publisher]
                assert key in plan.passes(publisher, subscriber)
                assert plan.between(publisher, subscriber)


@settings(max_examples=25)
@given(data=st.data())
def test_nothing_passes_between_two_that_the_table_does_not_name(plans, data):
    plan = data.draw(plans)
    wanted = {}
    for key, publishers, subscribers in table_rows(plan.swarm):
        for publisher in publishers:
            for subscriber in subscribers:
                wanted.setdefault((publisher, subscriber), []).append(key)
    others = set(plan.identities) - {ROUTER}
    for sender in others:
        for receiver in others:
            assert plan.passes(sender, receiver) == tuple(wanted.get((sender, receiver), ()))
            assert bool(plan.between(sender, receiver)) == ((sender, receiver) in wanted)


def test_agents_are_linked_along_the_graph_only(make_plan):
    plan = make_plan()
    others = {"gateway", "kinematics", "recorder", "operator", "console"}
    assert set(plan.partners["uav1"]) - others == {"leader", "uav2"}
    assert plan.passes("leader", "uav1") == (Key("status", "leader"),)  # its pose comes from the gateway
    assert plan.passes("uav1", "leader") == ()
    assert set(plan.partners["leader"]) - others == {"uav1"}
    assert set(plan.partners["uav3"]) - others == {"uav2", "uav4"}
    assert plan.links["uav3"] == plan.partners["uav3"]


def test_with_a_router_it_is_the_only_link_of_each_process_and_all_dial_it(make_plan):
    plan = make_plan({"network.mode": "router"})
    others = plan.identities[1:]
    assert plan.identities[0] == ROUTER
    assert plan.routers == (ROUTER,)
    assert plan.links[ROUTER] == others
    assert plan.dials[ROUTER] == ()
    for identity in others:
        assert plan.links[identity] == plan.dials[identity] == (ROUTER,)


def test_a_router_changes_no_links(make_plan):
    plan, routed = make_plan(), make_plan({"network.mode": "router"})
    for identity in plan.identities:
        assert [other for other in routed.partners[identity] if other != ROUTER] == list(plan.partners[identity])


@settings(max_examples=25)
@given(data=st.data())
def test_over_a_link_to_the_router_goes_what_its_client_publishes_and_subscribes_to(plans, data):
    plan = data.draw(plans.filter(lambda plan: plan.routers))
    for identity in plan.identities[1:]:
        subscribed = {key for key in plan.publishes[identity] if plan.subscribers(key)}
        assert set(plan.passes(identity, ROUTER)) == subscribed
        assert all(key.kind == "estimate" for key in set(plan.publishes[identity]) - subscribed)  # of the last drones
        assert set(plan.passes(ROUTER, identity)) == set(plan.subscribes[identity])


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_no_process_dials_the_operator(make_plan, mode):
    plan = make_plan({"network.mode": mode})
    assert plan.dials["operator"]
    assert all("operator" not in dialled for dialled in plan.dials.values())


@pytest.mark.parametrize("identity", ["uav9", "stranger"])
def test_a_stranger_publishes_and_subscribes_to_nothing(make_plan, identity):
    plan = make_plan()
    assert not [key for key, senders, receivers in plan.flows if identity in (*senders, *receivers)]
    for mapping in (plan.publishes, plan.subscribes, plan.partners, plan.links, plan.dials, plan.hosts, plan.endpoints):
        assert identity not in mapping
        with pytest.raises(KeyError):
            mapping[identity]
    assert plan.passes("gateway", identity) == plan.passes(identity, "gateway") == ()


def test_the_operator_stands_last_is_not_started_and_listens_nowhere(make_plan):
    plan = make_plan()
    assert plan.identities[-2:] == ("operator", "console")
    assert plan.started == plan.identities[:-2]
    assert tuple(plan.endpoints) == plan.identities[:-2]


def test_a_flight_waits_for_all_that_fly_a_drone(make_plan):
    agents = {1: "uav1", 2: "uav2", 3: "uav3", 4: "uav4"}
    assert make_plan().pilots == {0: "leader", **agents}
    virtual = make_plan(VIRTUAL)
    assert virtual.pilots == agents
    assert virtual.pilot[0] == "leader"


def test_processes_are_found_by_their_kind(make_plan):
    plan = make_plan()
    assert plan.of(processes.AGENT) == ("uav1", "uav2", "uav3", "uav4")
    assert plan.of(processes.LEADING) == ("leader",)
    assert plan.of(processes.ROUTER) == ()


@pytest.mark.parametrize("changes", [None, VIRTUAL], ids=["flying", "virtual"])
def test_every_process_has_a_port_of_its_own_that_no_other_moves(make_plan, changes):
    found = make_plan({"network.base_port": 8000, **(changes or {})}).endpoints
    ports = {
        "gateway": 8000, "kinematics": 8001, "leader": 8016, "uav1": 8020, "uav2": 8024, "uav3": 8028, "uav4": 8032,
        "recorder": 8003,
    }  # fmt: skip
    assert found == {identity: f"127.0.0.1:{port}" for identity, port in ports.items()}


def test_the_port_for_operators_is_as_far_below_the_base_port_as_the_other_place_is_above_it(make_plan):
    plan = make_plan({"network.base_port": 8000})
    for identity, endpoint in plan.endpoints.items():
        address, _, port = endpoint.rpartition(":")
        assert plan.reserved[identity] == f"{address}:{8000 - 1 - (int(port) - 8000)}"
    assert make_plan(TWO_HOSTS).reserved["uav3"] == f"10.0.0.7:{7450 - 1 - 16 - 3 * 4}"


def test_a_drones_port_depends_on_its_id_alone(make_plan):
    changes = {"drones.2.id": 30, "graph.edges": [[0, 1], [1, 30], [30, 3], [3, 4]], "network.base_port": 8000}
    found = make_plan(changes).endpoints
    assert found["uav30"] == "127.0.0.1:8136"
    assert found["uav3"] == "127.0.0.1:8028"


def test_endpoints_follow_the_hosts_and_a_drones_own_address(make_plan):
    found = make_plan(TWO_HOSTS).endpoints
    assert found["gateway"] == "10.0.0.1:7450"
    assert found["uav2"] == "[fe80::1]:7474"
    assert found["uav3"] == "10.0.0.7:9000"


def test_with_a_router_it_stands_first_and_alone_listens(make_plan):
    plan = make_plan({**TWO_HOSTS, "network.mode": "router", "hosts.air.processes": ["leader", "recorder", "router"]})
    assert plan.identities[0] == ROUTER
    assert plan.endpoints == {ROUTER: "[fe80::1]:7454"}
    assert plan.processes_on("air")[0] == ROUTER
    assert ROUTER not in make_plan().identities


def test_every_process_runs_on_exactly_one_host(make_plan):
    plan = make_plan(TWO_HOSTS)
    placed = [identity for host in plan.swarm.hosts for identity in plan.processes_on(host)]
    assert sorted(placed) == sorted(plan.identities[:-2])
    assert plan.processes_on("air") == ("leader", "uav2", "recorder")
    assert plan.hosts["uav1"] == "ground"


def test_the_recorders_host_conducts(make_plan):
    plan = make_plan(TWO_HOSTS)
    assert [plan.conducts(host) for host in plan.swarm.hosts] == [False, True]


def test_by_name_each_is_dialled_at_a_host_of_its_own_name_at_its_usual_port(make_swarm):
    swarm = make_swarm({"hosts.far.address": "192.0.2.1", "drones.1.address": "192.0.2.7:9000"})
    plan, usual = Plan(swarm, by_name=True), Plan(make_swarm())
    for endpoints, others in ((plan.endpoints, usual.endpoints), (plan.reserved, usual.reserved)):
        assert endpoints
        for identity, endpoint in endpoints.items():
            port = others[identity].rpartition(":")[2]
            assert endpoint == f"{identity}:{port}"
            assert plan.bound(endpoint) == f"0.0.0.0:{port}"
    assert usual.bound(usual.endpoints["uav1"]) == usual.endpoints["uav1"]
