from flockwire_cli.verdict import conclude
from recorded_flights import Flight, record


def test_a_flight_that_was_ended_before_its_take_off_has_one_sentence_and_no_checks(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Flight, "missions", lambda _: iter(()))
    record(tmp_path / "trace.mcap", begin=-0.5, end=0.5)
    assert conclude("", tmp_path) == 1
    printed = capsys.readouterr()
    assert "ok " not in printed.out
    assert printed.err.splitlines()[-1] == "flockwire: the flight failed: it ended before take-off"
