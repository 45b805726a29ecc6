"""bench/transport.py measures what arrives: its processes, and its table."""

from itertools import count

import pytest
import transport
from fleet import free_ports
from transports import OURS, PLAIN, Place, prepare, transports

MESSAGES = 60  # besides the first hundred; the processor time is taken at every fiftieth
ALL = {one.name: one for one in transports()}


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "test"), [(OURS, "fan-out"), (OURS, "ping-pong"), (PLAIN, "fan-out"), ("UDP", "ping-pong")]
)
def test_every_message_arrives(name, test, tmp_path, monkeypatch):
    monkeypatch.setattr(transport, "PORTS", count(free_ports()))
    prepare(Place(tmp_path, free_ports(), 6))
    p50, p99, cost, lost = transport.run(ALL[name], test, tmp_path, MESSAGES)
    assert 0.0 < p50 <= p99
    assert cost > 0.0
    assert lost < 0.1  # a busy machine's ticker may leave out some


def test_flockwire_is_judged_against_all_and_without_security_against_its_like(capsys):
    found = {OURS: 400.0, "Zenoh": 380.0, "DDS Security": 410.0, PLAIN: 300.0, "CycloneDDS": 390.0}
    rows = {(test, name): [(p50, 2.0 * p50, 100.0, 0.0)] for test in transport.TESTS for name, p50 in found.items()}
    assert not transport.table(rows)
    zenoh, security, plain, dds = capsys.readouterr().out.splitlines()[2:6]
    assert zenoh.endswith("1.05 1.05 1.00                       within 1.15")
    assert security.split()[-2:] == ["within", "1"]
    assert plain.split()[-1] == "1.00"
    assert dds.split()[-3:] == ["0.77", "ABOVE", "1"]
    rows = {row: [(300.0, *others[1:])] if row[1] == OURS else [others] for row, (others,) in rows.items()}
    assert transport.table(rows)
