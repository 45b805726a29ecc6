from flockwire.wire.wiring import ROUTER, agent_identity, endpoints, host_of, identities, processes_on

TWO_HOSTS = {
    "hosts": {
        "ground": {"address": "10.0.0.1", "processes": ["gateway"]},
        "air": {"address": "fe80::1", "processes": ["leader", "recorder"]},
    },
    "drones.2.host": "air",
    "drones.3.address": "10.0.0.7:9000",
}


def test_drone_zero_is_flown_by_the_leader():
    assert agent_identity(0) == "leader"
    assert agent_identity(7) == "uav7"


def test_the_operator_stands_last_and_listens_nowhere(make_swarm):
    swarm = make_swarm()
    assert identities(swarm)[-1] == "operator"
    assert tuple(endpoints(swarm)) == identities(swarm)[:-1]


def test_every_process_has_a_port_of_its_own(make_swarm):
    found = endpoints(make_swarm({"network.base_port": 8000})).values()
    assert list(found) == [f"127.0.0.1:{8000 + k}" for k in range(8)]


def test_endpoints_follow_the_hosts_and_a_drones_own_address(make_swarm):
    found = endpoints(make_swarm(TWO_HOSTS))
    assert found["gateway"].startswith("10.0.0.1:")
    assert found["uav2"].startswith("[fe80::1]:")
    assert found["uav3"] == "10.0.0.7:9000"


def test_with_a_router_it_stands_first_and_alone_listens(make_swarm):
    swarm = make_swarm({**TWO_HOSTS, "network.mode": "router", "hosts.air.processes": ["leader", "recorder", "router"]})
    assert identities(swarm)[0] == ROUTER
    assert endpoints(swarm) == {ROUTER: "[fe80::1]:7450"}
    assert processes_on(swarm, "air")[0] == ROUTER
    assert ROUTER not in identities(make_swarm())


def test_every_process_runs_on_exactly_one_host(make_swarm):
    swarm = make_swarm(TWO_HOSTS)
    placed = [identity for host in swarm.hosts for identity in processes_on(swarm, host)]
    assert sorted(placed) == sorted(identities(swarm)[:-1])
    assert processes_on(swarm, "air") == ("leader", "uav2", "recorder")
    assert host_of(swarm, "uav1") == "ground"
