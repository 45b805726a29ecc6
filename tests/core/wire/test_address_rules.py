"""The rules of hosts, ports and addresses, which only the plan can judge."""

import pytest
from flockwire_core.loading import SwarmFileError

TWO_HOSTS = {"a": {"address": "127.8.9.1"}, "b": {"address": "::1"}}
WRONG = [
    (
        {"ros": {"serve": True, "router": "127.0.0.1:7450"}},
        "ros.router = '127.0.0.1:7450': gateway listens there; choose another port",
    ),
    # processes
    (
        {"hosts.a.processes": ["uav1"]},
        "hosts.a.processes.0 = 'uav1': must be one of ['router', 'gateway', 'tracker-sim', 'kinematics', "
        "'leader', 'recorder', 'ros']",
    ),
    (
        {"hosts": {"a": {}, "b": {"address": "10.0.0.2"}}, "drones.2.host": "b", "drones.2.airframe": "tello"},
        "drones.host: driver2 runs on b, its simulated airframe on a; both must be on one host",
    ),
    ({"hosts.a.processes": ["operator"]}, "hosts.a.processes.0 = 'operator': must be one of ['router', "),
    (
        {"hosts": {"a": {}, "b": {"address": "10.0.0.2"}}, "drones.2.host": "b"},
        "hosts.a.address = '127.0.0.1': the other hosts cannot reach it there; name its address in their network",
    ),
    (
        {"hosts": {"a": {"address": "0.0.0.0"}, "b": {"address": "10.0.0.2"}}, "drones.2.host": "b"},
        "hosts.a.address = '0.0.0.0': the other hosts cannot reach it there; name its address in their network",
    ),
    (
        {"hosts": {"a": {"processes": ["leader"]}, "b": {"processes": ["leader"]}}},
        "hosts.b.processes.0 = 'leader': host a runs it already",
    ),
    # ports
    (
        {"network.base_port": 64000, "drones.4.id": 380, "graph.edges.3": [3, 380]},
        "network.base_port = 64000: uav380 would listen at port 65536, the highest is 65535",
    ),
    ({"network.base_port": 1024}, "network.base_port = 1024: gateway would listen at port 1023, the lowest is 1024"),
    # addresses
    (
        {"drones.1.address": "10.0.0.1:9000", "drones.2.address": "10.0.0.1:9000"},
        "drones.address: uav2 and uav1 have one address, 10.0.0.1:9000",
    ),
    ({"drones.1.address": "127.0.0.1:7450"}, "drones.address: uav1 and gateway have one address, 127.0.0.1:7450"),
    # security
    (
        {"network.security": "none", "hosts": {"a": {"address": "10.0.0.1"}}},
        "network.security = 'none': gateway would listen at 10.0.0.1:7450; without security only loopback",
    ),
    (
        {"network.security": "none", "hosts": {"a": {"address": "::"}}, "network.mode": "router"},
        "network.security = 'none': router would listen at [::]:7454; without security only loopback",
    ),
    (
        {"network.security": "none", "drones.2.address": "[fe80::1]:9000"},
        "network.security = 'none': uav2 would listen at [fe80::1]:9000; without security only loopback",
    ),
    (
        {"network.security": "none", "hosts": {"a": {}, "b": {"address": "0.0.0.0"}}, "drones.2.host": "b"},
        "network.security = 'none': uav2 would listen at 0.0.0.0:7474; without security only loopback",
    ),
]


@pytest.mark.parametrize(("changes", "line"), WRONG, ids=[line.partition(":")[0] for _, line in WRONG])
def test_a_broken_rule_names_key_value_and_rule(make_swarm, changes, line):
    with pytest.raises(SwarmFileError) as refused:
        make_swarm(changes)
    lines = str(refused.value).split("\n")
    assert any(found.startswith(f"test.toml: {line}") for found in lines), lines


@pytest.mark.parametrize(
    "changes",
    [
        {"network.security": "none"},
        {"network.security": "none", "hosts": TWO_HOSTS},
        {"network.mode": "router", "hosts": {"a": {"processes": ["router"], "address": "10.0.0.1"}}},
        {"network.mode": "peers", "hosts": {"a": {"processes": ["router"], "address": "10.0.0.1"}}},
        {"network.base_port": 64000, "drones.4.id": 379, "graph.edges.3": [3, 379]},
        {  # there the router alone listens
            "network.base_port": 64000, "network.mode": "router", "drones.4.id": 380, "graph.edges.3": [3, 380],
        },
    ],
)  # fmt: skip
def test_what_keeps_the_rules_is_accepted(make_swarm, changes):
    assert make_swarm(changes) != make_swarm()
