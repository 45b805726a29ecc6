"""The swarm file that `flockwire init` writes."""

import json
import re

import pytest
from command_line import refused
from flockwire.loading import load_swarm


@pytest.mark.parametrize("drones", [2, 4, 60])
def test_a_new_file_is_accepted_without_a_warning(flockwire, tmp_path, drones):
    path = tmp_path / "my swarm.toml"
    assert flockwire("init", path, "--drones", drones).returncode == 0
    swarm = load_swarm(path)
    assert (swarm.name, len(swarm.drones)) == ("my_swarm", drones)
    assert "warning: leader" not in flockwire("check", path).stdout


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
    assert json.loads((tmp_path / named).read_text())["title"] == "flockwire swarm file"


def test_a_file_that_is_there_is_kept(flockwire, tmp_path):
    path = tmp_path / "swarm.toml"
    path.write_text("mine")
    assert "exists" in refused(flockwire("init", path))
    assert path.read_text() == "mine"
