"""What `flockwire new` writes: a law that is the documented one, which flies, and its test."""

import re

import pytest
from command_line import refused
from flockwire_core.loading import load_swarm


def test_it_is_the_law_of_the_page_and_its_test(flockwire, example, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = flockwire("new", "my_law")
    assert done.returncode == 0
    law = (tmp_path / "my_law.py").read_text()
    assert law == example("own_law", "python")
    assert example("testing", "python") in (tmp_path / "test_my_law.py").read_text()
    for command in re.findall(r"flockwire check \S+(?=,)", done.stdout):
        assert flockwire(*command.split()[1:]).returncode == 0
    assert load_swarm(tmp_path / "my_law.toml").control.law == "my_law.py:MyLaw"


def test_its_test_passes_and_can_fail(flockwire, tmp_path, monkeypatch, virtual_swarm):
    monkeypatch.chdir(tmp_path)
    flockwire("new", "pull_together")
    swarm = virtual_swarm(tmp_path / "pull_together.toml")
    assert swarm.t < 0.0
    swarm.forward(until=0.2)
    assert swarm.t == pytest.approx(0.2)
    with pytest.raises(AssertionError, match=r"more than 0.02 m off their places at t = 0.2 s: uav1 \d"):
        swarm.assert_in_formation(0.02)
    swarm.forward(until=6.0)
    swarm.assert_in_formation(0.02)
    assert set(swarm.errors()) == {1, 2, 3, 4}


def test_a_flight_that_never_begins_fails_the_test(flockwire, tmp_path, monkeypatch, virtual_swarm):
    monkeypatch.chdir(tmp_path)
    flockwire("new", "pull")
    (tmp_path / "pull.toml").write_text((tmp_path / "pull.toml").read_text() + "[limits]\nbattery_takeoff = 1.0\n")
    swarm = virtual_swarm(tmp_path / "pull.toml")
    monkeypatch.setattr("flockwire_core.ground.director.STAGE_TIME", 0)
    with pytest.raises(AssertionError, match="the flight failed at t = -1"):
        swarm.forward(until=1.0)


@pytest.mark.parametrize("name", ["2nd", "class", "my-law", "_x", "../x"])
def test_a_name_that_is_none_is_refused(flockwire, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert "must be a name in Python" in refused(flockwire("new", name))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["random", "numpy"])
def test_a_name_of_a_module_is_refused(flockwire, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert "is a module that others import" in refused(flockwire("new", name))
    assert not list(tmp_path.iterdir())


def test_what_is_there_is_kept(flockwire, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "test_mine.py").write_text("mine")
    assert "test_mine.py exists" in refused(flockwire("new", "mine"))
    assert [file.name for file in tmp_path.iterdir()] == ["test_mine.py"]
