"""The swarm file that `flockwire init` writes."""

import json
import re

import pytest
from command_line import refused
from flockwire_core.loading import load_swarm


@pytest.mark.parametrize("drones", [2, 4, 60])
def test_a_new_file_is_accepted_without_a_warning(flockwire, tmp_path, drones):
    path = tmp_path / "my swarm.toml"
    assert flockwire("init", path, "--drones", drones).returncode == 0
    swarm = load_swarm(path)
    assert (swarm.name, len(swarm.drones)) == ("my_swarm", drones)
    warned = [line for line in flockwire("check", path).stdout.splitlines() if line.startswith("warning")]
    assert all("Lemma 3 proves nothing on this graph" in line for line in warned)
    assert drones > 4 or not warned


def test_its_world_is_a_laboratorys_or_ideal_on_request(flockwire, tmp_path):
    for options, lag, noise, latency in (((), 0.25, 0.001, 0.008), (("--ideal",), 0.0, 0.0, 0.0)):
        path = tmp_path / f"swarm{len(options)}.toml"
        flockwire("init", path, *options)
        swarm = load_swarm(path)
        assert (swarm.gateway.noise, swarm.gateway.latency) == (noise, latency)
        assert {swarm.airframes[drone.airframe].lag for drone in swarm.drones} == {lag}
        assert (
            ("perfect world:" in path.read_text())
            == ("a perfect world:" in flockwire("check", path).stdout)
            == bool(options)
        )


@pytest.mark.parametrize("drones", [4, pytest.param(20, marks=pytest.mark.long)])
def test_a_new_swarm_passes_its_checks(flockwire, tmp_path, drones):
    path = tmp_path / "swarm.toml"
    flockwire("init", path, "--drones", drones)
    flown = flockwire("sim", path, "--duration", 15, "--no-trace")
    assert flown.stdout.endswith("all well\n"), flown.stdout


def test_every_commented_key_may_be_taken_in(flockwire, tmp_path):
    path = tmp_path / "swarm.toml"
    flockwire("init", path)
    text = path.read_text()
    prose = re.compile(r"^# (?=\[\[?[a-z_.]+\]|[a-z_]+ = )", re.MULTILINE)
    taken_in = tmp_path / "all.toml"
    taken_in.write_text(prose.sub("", text))
    assert len(prose.findall(text)) > 60
    assert load_swarm(taken_in).limits == load_swarm(path).limits


def test_no_comment_for_a_linter_is_in_it(flockwire, tmp_path):
    path = tmp_path / "swarm.toml"
    flockwire("init", path)
    assert "noqa" not in path.read_text()


def test_it_names_a_schema_that_is_there(flockwire, tmp_path):
    path = tmp_path / "swarm.toml"
    flockwire("init", path)
    named = path.read_text().split("\n")[0].removeprefix("#:schema ")
    assert "formation" in json.loads((tmp_path / named).read_text())["properties"]


def test_a_file_that_is_there_is_kept(flockwire, tmp_path):
    path = tmp_path / "swarm.toml"
    path.write_text("mine")
    assert "exists" in refused(flockwire("init", path))
    assert path.read_text() == "mine"
