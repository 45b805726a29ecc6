"""The examples: their files are accepted, their page names all, and one flies; the long tests fly the others."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import load_faults
from flockwire_lab.study.file import Study, load_study
from PIL import Image

EXAMPLES = Path(__file__).parents[2] / "examples"
FOLDERS = sorted(path.name for path in EXAMPLES.iterdir() if path.is_dir() and not path.name.startswith("."))
PAGE = (EXAMPLES / "README.md").read_text(encoding="utf-8")


def test_the_page_has_a_section_and_the_picture_of_each_example():
    assert sorted(re.findall(r"^## (\w+)$", PAGE, re.MULTILINE)) == FOLDERS
    for name in FOLDERS:
        section = PAGE.partition(f"## {name}\n")[2].partition("\n## ")[0]
        assert f"]({name}/picture.png)" in section
        with Image.open(EXAMPLES / name / "picture.png") as picture:
            assert picture.width >= 600
        assert (EXAMPLES / name / "picture.png").stat().st_size < 100_000


@pytest.mark.parametrize("name", FOLDERS)
def test_the_files_of_an_example_are_accepted(name, monkeypatch):
    monkeypatch.chdir(EXAMPLES / name)
    plan = Plan(load_swarm(Path("swarm.toml")))
    assert plan.swarm.gateway.noise > 0  # of a laboratory's tracker, as the page says
    assert plan.swarm.gateway.latency > 0
    for file in set(Path().glob("*.toml")) - {Path("swarm.toml")}:
        assert file.name in PAGE
        if file.name == "walk.toml":
            assert load_faults(file, plan)
        else:
            assert load_study(file, {}, Study).runs >= 10


def test_the_example_that_no_long_test_flies_does(flockwire, monkeypatch):
    monkeypatch.chdir(EXAMPLES / "teleoperated_leader")
    done = flockwire("sim", "swarm.toml", "--no-trace", "--duration", 8)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith("flockwire: all well\n")
