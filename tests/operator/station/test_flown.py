"""What flies is known beside its file, whatever becomes of the file; the lock says whether it still flies."""

import errno
import fcntl
import os

import pytest
import tomli_w
from command_line import refused
from flockwire_core import clock
from flockwire_core.clock import SteadyClock
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import read_swarm
from flockwire_operator.cli.inputs import load, load_flying
from flockwire_operator.station.flown import OtherFlightError, as_flown, flown, flown_by
from flockwire_operator.station.folders import keys_folder
from flockwire_operator.station.giving import Answer


@pytest.fixture
def file(tmp_path, swarm_table):
    path = tmp_path / "lab.toml"
    path.write_text(tomli_w.dumps(swarm_table({"formations.wide": {"kind": "circle", "radius": 4.0}})))
    return path


@pytest.fixture
def what(file, tmp_path):
    return flown_by(read_swarm(file), file, tmp_path / "keys")


def change(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


CHANGES = {
    "name": ('name = "flock"', 'name = "other"'),
    "port": ('name = "flock"', 'name = "flock"\nnetwork = { base_port = 31000 }'),
    "broken": ('name = "flock"', "name = flock"),
}


def test_nothing_flies_by_a_file_before_and_after(file, what):
    assert as_flown(file) is None
    with flown(file, what):
        assert as_flown(file) == what
    assert as_flown(file) is None
    assert list((file.parent / ".flockwire").iterdir()) == []


def test_it_is_kept_until_the_last_has_ended(file, what):
    with flown(file, what):
        with flown(file, what):
            pass
        assert as_flown(file) == what
    assert as_flown(file) is None


def test_what_a_crash_left_behind_no_longer_flies_and_is_written_over(file, what):
    with flown(file, what):
        (place,) = (file.parent / ".flockwire").iterdir()
        left = place.read_bytes()
    place.write_bytes(left + left)
    assert as_flown(file) is None
    with flown(file, what):
        assert place.read_bytes() == left


def test_a_changed_file_is_not_flown_beside_what_flies_by_it(file, what):
    with flown(file, what):
        change(file, *CHANGES["name"])
        other = flown_by(read_swarm(file), file, file.parent)
        with (
            pytest.raises(OtherFlightError, match=r"lab\.toml: a swarm flies by an earlier version"),
            flown(file, other),
        ):
            pass
        assert as_flown(file) == what


def test_where_nothing_can_be_written_it_flies_anyway(file, what):
    (file.parent / ".flockwire").touch()
    with flown(file, what):
        assert as_flown(file) is None


@pytest.mark.parametrize("changed", CHANGES)
def test_an_order_goes_to_what_flies_when_its_file_has_changed(file, what, changed, flockwire, monkeypatch):
    given = []

    async def give(plan, keys, order):
        given.append((plan.swarm, keys, order.verb))
        return Answer(("uav1",))

    monkeypatch.setattr("flockwire_operator.station.giving.give", give)
    with flown(file, what):
        change(file, *CHANGES[changed])
        for verb in ("hold", "land", "stop"):
            done = flockwire(verb, file)
            assert done.returncode == 0
            assert "the order is for 'flock', as it took off" in done.stderr
    assert [(str(keys), verb) for _, keys, verb in given] == [(what.keys, verb) for verb in ("hold", "land", "stop")]
    assert {swarm.name for swarm, _, _ in given} == {"flock"}
    assert {swarm.network.base_port for swarm, _, _ in given} == {what.swarm.network.base_port}


def test_an_unchanged_file_gives_no_message(file, what, capsys):
    with flown(file, what):
        plan, keys = load_flying(file, None)
        assert (plan.swarm, str(keys)) == (what.swarm, what.keys)
        assert load_flying(file, file.parent)[1] == file.parent  # --keys says where they are
    assert capsys.readouterr().err == ""


@pytest.mark.sources  # replaces compiled functions
@pytest.mark.parametrize("look", [load, lambda file: load_flying(file, None)])
def test_a_new_command_has_the_time_of_what_flies_though_the_clock_was_set_since(file, what, monkeypatch, look):
    steady = SteadyClock(lambda: 70 * SECOND, lambda: 50 * SECOND)
    monkeypatch.setattr(clock, "_STEADY", steady)
    with flown(file, what.model_copy(update={"epoch": 5 * SECOND})):
        look(file)
    assert steady.now() == 55 * SECOND


def test_where_nothing_flies_a_broken_file_is_refused(file, flockwire):
    change(file, *CHANGES["broken"])
    assert "not TOML" in refused(flockwire("stop", file))


def test_a_symbolic_link_and_its_target_have_one_flight_and_one_folder_of_keys(file, what, tmp_path, make_plan):
    link = tmp_path / "links" / "other.toml"
    link.parent.mkdir()
    link.symlink_to(file)
    with flown(link, what):
        assert as_flown(file) == as_flown(link) == what
    plan = make_plan()
    assert keys_folder(link, plan, None) == keys_folder(file, plan, None)


def test_a_folder_whose_name_is_not_utf_8(file, what, tmp_path):
    keys = tmp_path / os.fsdecode(b"Versuch\xe4")
    with flown(file, flown_by(what.swarm, file, keys)):
        assert as_flown(file).keys_folder == keys


def test_on_a_file_system_without_locks_it_flies_without_a_record(file, what, monkeypatch):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with flown(file, what), flown(file, what):
        assert as_flown(file) is None


def test_what_flies_searches_its_law_beside_its_file(file, tmp_path):
    change(file, 'law = "paper"', 'law = "my_law.py:MyLaw"')
    what = flown_by(read_swarm(file), file, tmp_path / "keys")
    with flown(file, what):
        assert as_flown(file) == what
        assert as_flown(file).swarm.folder == str(tmp_path)
