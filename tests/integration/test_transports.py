"""The transports that lab/bench/transport.py compares."""

from itertools import count
from unittest import mock

import pytest
import transport
import transports
from flockwire_core import clock
from ports import free_ports
from transports import OURS, PLAIN, Place


@pytest.fixture
def places(monkeypatch):
    """Have processes of other tests, and of benches, at other ports."""
    monkeypatch.setattr(transport, "PORTS", count(free_ports(), 10))
    for name, value in clock.epoch_environment().items():
        monkeypatch.setenv(name, value)


def test_what_is_not_installed_is_named_with_what_installs_it():
    with mock.patch.object(transports, "find_spec", return_value=None), mock.patch("shutil.which", return_value=None):
        lacking = {one.name: one.lacks for one in transports.transports() if one.lacks}
    install = "uv pip install --python .venv-dev -r lab/bench/requirements.txt"
    assert lacking == {"MQTT, TLS": f"{install}; apt-get install mosquitto", "CycloneDDS": install}


def test_a_name_that_no_transport_has_is_an_error(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["transport.py", "--only", "Zeno"])
    with pytest.raises(SystemExit, match="2"):
        transport.main()
    assert "invalid choice: 'Zeno'" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("name", [OURS, PLAIN, "Zenoh", "UDP"])
def test_both_ends_receive_each_message(name, tmp_path, places):
    (one,) = (one for one in transports.transports() if one.name == name)
    transports.prepare(Place(tmp_path, next(transport.PORTS), 2))
    p50, p99, cost, lost = transport.run(one, "ping-pong", tmp_path, 100)
    assert 0.0 < p50 <= p99
    assert cost > 0.0
    assert lost <= 0.1  # of a machine that does much else
