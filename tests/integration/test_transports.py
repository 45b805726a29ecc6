"""The transports that lab/bench/transport.py compares, and the traffic that its floor repeats."""

import os
from itertools import count
from unittest import mock

import floor
import pytest
import transport
import transports
from counting import PAPER
from flockwire_core import clock
from flockwire_core.loading import load_swarm
from flockwire_lab.flight import TraceFile
from flockwire_lab.world import World
from transports import OURS, PLAIN, Place


@pytest.fixture
def free_ports(monkeypatch):
    """Have processes of other tests, and of benches, at other ports."""
    monkeypatch.setattr(transport, "PORTS", count(31000 + os.getpid() % 500 * 2, 10))
    for name, value in clock.epoch_environment().items():
        monkeypatch.setenv(name, value)


def test_what_is_not_installed_is_named_with_what_installs_it():
    with mock.patch.object(transports, "find_spec", return_value=None), mock.patch("shutil.which", return_value=None):
        lacking = {one.name: one.lacks for one in transports.transports() if one.lacks}
    install = "uv pip install --python .venv-dev -r lab/bench/requirements.txt"
    dds, mqtt = install, f"{install}; apt-get install mosquitto"
    assert lacking == {"DDS Security": dds, "MQTT, TLS": mqtt, "CycloneDDS": dds, "MQTT": mqtt}


def test_a_name_that_no_transport_has_is_an_error(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["transport.py", "--only", "Zeno"])
    with pytest.raises(SystemExit, match="2"):
        transport.main()
    assert "invalid choice: 'Zeno'" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("name", [OURS, PLAIN, "Zenoh", "UDP"])
def test_both_ends_receive_each_message(name, tmp_path, free_ports):
    (one,) = (one for one in transports.transports() if one.name == name)
    transports.prepare(Place(tmp_path, next(transport.PORTS), 2))
    p50, p99, cost, lost = transport.run(one, "ping-pong", tmp_path, 100)
    assert 0.0 < p50 <= p99
    assert cost > 0.0
    assert lost <= 0.1  # of a machine that does much else


def test_flockwire_is_judged_against_all_and_without_security_against_its_like(capsys):
    found = {OURS: 400.0, "Zenoh": 380.0, "DDS Security": 410.0, PLAIN: 300.0, "CycloneDDS": 390.0}
    rows = {(test, name): [(p50, 2.0 * p50, 100.0, 0.0)] for test in transport.TESTS for name, p50 in found.items()}
    assert not transport.table(rows)
    zenoh, security, plain, dds = capsys.readouterr().out.splitlines()[2:6]
    assert zenoh.split()[-5:] == ["1.05", "within", "1.15", "1.05", "1.00"]
    assert security.split()[-5:-2] == ["0.98", "within", "1"]
    assert plain.split()[-1] == "1.00"
    assert dds.split()[-6:] == ["1.03", "ABOVE", "1", "1.03", "1.00", "0.77"]
    rows = {row: [(300.0, *others[1:])] if row[1] == OURS else [others] for row, (others,) in rows.items()}
    assert transport.table(rows)


def test_the_floor_repeats_what_a_flight_carried(tmp_path):
    swarm = load_swarm(PAPER)
    trace = TraceFile(tmp_path / "trace.mcap", swarm, "", 0)
    World(swarm, 0, 4.0, tap=trace.take).run()
    trace.close()
    carried = floor.traffic(tmp_path / "trace.mcap")
    assert carried.rates["uav1/pose"] == pytest.approx(100.0, rel=0.05)
    assert carried.rates["uav1/command"] == pytest.approx(100.0, rel=0.05)
    assert carried.rates["uav1/status"] == pytest.approx(10.0, rel=0.1)
    assert 100 < carried.sizes["uav1/estimate"] < 300
