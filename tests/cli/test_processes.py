import socket
import sys
from pathlib import Path

import pytest
from flockwire_cli.processes import busy_endpoint, command


@pytest.fixture
def taken():
    """Return a port of this machine at which somebody listens."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield listener.getsockname()[1]


def test_an_endpoint_in_use_is_told_with_its_process_and_key(make_swarm, taken):
    line = busy_endpoint(make_swarm({"network.base_port": taken}), ["gateway"])
    assert line.startswith(f"network.base_port = {taken}: gateway listens at 127.0.0.1:{taken}, which is in use")


def test_the_address_of_another_machine_is_told(make_swarm):
    swarm = make_swarm({"hosts.far.address": "192.0.2.1"})
    assert "cannot assign requested address" in busy_endpoint(swarm, ["gateway"])


def test_endpoints_of_others_are_not_looked_at(make_swarm, taken):
    swarm = make_swarm({"drones.1.address": f"127.0.0.1:{taken}"})
    assert busy_endpoint(swarm, []) == ""
    assert busy_endpoint(swarm, ["uav1"]) != ""


def test_a_free_endpoint_is_no_problem(make_swarm):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port = listener.getsockname()[1]
    assert busy_endpoint(make_swarm({"network.base_port": port}), ["gateway"]) == ""


@pytest.mark.parametrize(
    ("identity", "arguments"),
    [
        ("uav3", ["agent", "s.toml", "3", "--keys", "k"]),
        ("leader", ["leader", "s.toml", "--keys", "k"]),
        ("router", ["router", "s.toml", "--keys", "k"]),
        ("recorder", ["recorder", "s.toml", "--keys", "k", "--out", "runs/x"]),
    ],
)
def test_a_process_is_started_by_its_own_command(identity, arguments):
    line = command(identity, Path("s.toml"), Path("runs/x"), Path("k"))
    assert line == [sys.executable, "-m", "flockwire_cli", *arguments]
