import socket
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from flockwire_operator.station import host as hosts
from flockwire_operator.station.flown import flown, flown_by
from flockwire_operator.station.host import Host, PortInUseError, alone, busy_endpoint
from ports import free_ports


@pytest.fixture
def taken():
    """Return a port of this machine at which somebody listens."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield listener.getsockname()[1]


def test_an_endpoint_in_use_is_reported_with_its_process_and_key(make_plan, taken):
    line = busy_endpoint(make_plan({"network.base_port": taken}), ["gateway"])
    assert line.startswith(f"network.base_port = {taken}: gateway listens at 127.0.0.1:{taken}, which is in use")


def test_over_quic_it_is_the_udp_port_that_must_be_free(make_plan, taken):
    changes = {"network.base_port": taken, "network.link": "quic"}
    assert busy_endpoint(make_plan(changes), ["gateway"]) == ""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", taken))
        assert f"127.0.0.1:{taken}, which is in use" in busy_endpoint(make_plan(changes), ["gateway"])


def test_the_address_of_another_machine_is_reported(make_plan):
    plan = make_plan({"hosts.far.address": "192.0.2.1"})
    assert "cannot assign requested address" in busy_endpoint(plan, ["gateway"])


def test_endpoints_of_others_are_not_looked_at(make_plan, taken):
    plan = make_plan({"drones.1.address": f"127.0.0.1:{taken}"})
    assert busy_endpoint(plan, []) == ""
    assert f"uav1 listens at 127.0.0.1:{taken}, which is in use" in busy_endpoint(plan, ["uav1"])


def test_a_free_endpoint_is_not_a_problem(make_plan):
    assert busy_endpoint(make_plan({"network.base_port": free_ports()}), ["gateway"]) == ""


@pytest.mark.parametrize(
    ("identity", "arguments"),
    [
        ("gateway", ["gateway", "s.toml", "--keys", "k"]),
        ("uav3", ["agent", "s.toml", "3", "--keys", "k"]),
        ("leader", ["leader", "s.toml", "--keys", "k"]),
        ("router", ["router", "s.toml", "--keys", "k"]),
        ("recorder", ["recorder", "s.toml", "--keys", "k", "--out", "runs/x"]),
    ],
)
def test_a_process_is_started_by_its_own_command(make_plan, identity, arguments):
    plan = make_plan({"network.mode": "router"})
    line = Host(plan, Path("s.toml"), "localhost", Path("runs/x"), Path("k")).command_line(identity)
    assert line == [sys.executable, "-P", "-m", "flockwire_operator", *arguments]


def test_faults_go_to_those_whose_cores_inject_them_with_the_time_of_take_off_where_it_is_known(make_plan):
    plan = make_plan({"network.mode": "router"})
    host = Host(plan, Path("s"), "localhost", Path("o"), Path("k"))
    plain = {identity: host.command_line(identity) for identity in plan.started}
    host = replace(host, faults_file=Path("f"))
    injecting = ("gateway", "kinematics", "recorder", "uav1", "uav2", "uav3", "uav4")
    for took_off, more in ((None, []), (17, ["--took-off", "17"])):
        lines = {identity: host.command_line(identity, took_off) for identity in plan.started}
        longer = {identity: line[len(plain[identity]) :] for identity, line in lines.items() if line != plain[identity]}
        assert longer == {identity: ["--faults", "f", *more] for identity in injecting}


def test_two_stations_of_one_swarm_exclude_each_other(make_plan, tmp_path):
    plan = make_plan({"network.base_port": free_ports()})
    (tmp_path / f"{plan.started[0]}.key").touch()
    host = Host(plan, None, "local", None, tmp_path)
    refused = pytest.raises(PortInUseError, match="another `flockwire up` flies with these keys")
    with alone(host), refused, alone(host):
        pass
    with alone(host):  # the lock is gone with its holder
        pass


def test_a_terminal_that_takes_no_output_is_not_taken_for_another_station(make_plan, tmp_path):
    host = Host(make_plan({"network.base_port": free_ports()}), None, "local", None, tmp_path)
    with pytest.raises(BlockingIOError), alone(host):
        raise BlockingIOError


def test_nobody_is_told_to_end_processes_whose_drones_still_land(make_plan, tmp_path, monkeypatch):
    plan, file = make_plan(), tmp_path / "lab.toml"
    file.write_text("")
    host = Host(plan, file, "local", None, tmp_path / "keys")
    monkeypatch.setattr(hosts, "busy_endpoint", lambda *_: "in use; end that process")
    with pytest.raises(PortInUseError, match="in use; end that process"), alone(host):
        pass
    still = pytest.raises(PortInUseError, match="they land the drones and end by themselves")
    with flown(file, flown_by(plan.swarm, file, host.keys)), still, alone(host):  # its station was killed
        pass


def test_without_a_folder_of_keys_there_is_no_lock(make_plan, tmp_path):
    host = Host(make_plan(), None, "localhost", None, tmp_path / "none")
    with alone(host), alone(host):
        assert not host.keys.exists()
