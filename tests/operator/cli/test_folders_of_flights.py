"""A flight has a folder of its own, and is judged by its own trace."""

import tomli_w
from flockwire_core import clock
from flockwire_operator.cli.flights import NO_TRACE
from flockwire_operator.cli.inputs import own_folder
from recorded_flights import record


def test_two_commands_in_one_second_have_two_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    second = clock.local()
    monkeypatch.setattr(clock, "local", lambda: second)
    folders = [own_folder(None, "mine") for _ in range(3)]
    assert len(set(folders)) == 3
    assert all(folder.is_dir() for folder in folders)
    assert own_folder(tmp_path, "mine") == tmp_path


def test_conduct_judges_no_other_flight_where_nothing_was_recorded(tmp_path, swarm_table, flockwire, monkeypatch):
    async def fly(*_):
        return ""

    monkeypatch.setattr("flockwire_operator.station.conduct.conduct", fly)
    file, out = tmp_path / "mine.toml", tmp_path / "runs"
    file.write_text(tomli_w.dumps(swarm_table({})))
    (out / "20200101-000000").mkdir(parents=True)
    record(out / "20200101-000000" / "trace.mcap", begin=-0.5, end=0.5)
    done = flockwire("conduct", file, "--out", out)
    assert done.returncode == 1
    assert NO_TRACE.format(out=out) in done.stderr
