"""A newcomer's first minutes, by the documents alone: a swarm, a law with a parameter, a study over it, figures."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OWN_LAW = (ROOT / "docs/own_law.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(page, language, containing=""):
    """Return the first block of a page in a language, with a word in it."""
    return next(text for text in re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL) if containing in text)


@pytest.fixture
def run(tmp_path):
    """Run a command in a folder that has the newcomer's files; returns what it printed."""

    def run(*arguments, status=0):
        line = [sys.executable, "-m", "flockwire_operator", *map(str, arguments)]
        environment = os.environ | {"PYTHONPATH": "."}  # as docs/own_law.md has it
        done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.mark.long
def test_a_swarm_a_law_a_study_and_its_figures(run, tmp_path):
    assert "    flockwire check my_law.toml" in OWN_LAW
    swarm = block(README, "toml", "graph")
    (tmp_path / "my_law.toml").write_text(swarm + "\n" + block(OWN_LAW, "toml", "law ="))
    (tmp_path / "my_law.py").write_text(block(OWN_LAW, "python"))
    (tmp_path / "gains.toml").write_text(block(OWN_LAW, "toml", "[grid]"))
    assert "law" in run("check", "my_law.toml")
    assert "all well" in run("sim", "my_law.toml", "--seed", 1, "--duration", 15, "--out", "flight")
    pictures = {picture.stem for picture in (tmp_path / "flight").glob("*.png")}
    assert {"trajectories", "formation_error", "velocities", "commands", "distances"} <= pictures
    study = block(OWN_LAW, "toml", "[grid]")
    (command,) = re.findall(r"^    flockwire (study \S+ \S+) ", OWN_LAW, re.MULTILINE)
    printed = run(
        *command.split(), "--runs", 1, "--duration", 8, "--out", "study", "--jobs", 1, status=1
    )  # the lowest gain is too low
    for gain in re.search(r"gain = \[(.*)\]", study)[1].split(", "):
        assert f"gain={gain} " in printed
