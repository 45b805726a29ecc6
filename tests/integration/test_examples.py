"""Every command of the examples' page runs as written, in a copy of its folder, with shorter flights and studies."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from fleet import PATIENCE
from ports import free_port, free_ports

pytestmark = pytest.mark.long
EXAMPLES = Path(__file__).parents[2] / "examples"
PAGE = (EXAMPLES / "README.md").read_text(encoding="utf-8")
SHORTER = {
    "sim": ["--duration", "12"],
    "study": ["--runs", "1", "--duration", "14", "--jobs", "1"],
    "up": ["--duration", "8"],
}


def commands(name):
    """Return the commands of an example's section, without comments."""
    section = PAGE.partition(f"## {name}\n")[2].partition("\n## ")[0]
    return [shlex.split(line, comments=True) for line in re.findall(r"^    (.*)$", section, re.MULTILINE)]


@pytest.fixture
def example(request, tmp_path):
    """Return a copy of an example's folder, on ports of its own."""
    folder = shutil.copytree(EXAMPLES / request.param, tmp_path / request.param)
    file = folder / "swarm.toml"
    text = file.read_text() + f"\n[network]\nbase_port = {free_ports()}\n"
    if tomllib.loads(text)["gateway"].get("source") == "natnet":
        text += f"[gateway.natnet]\ncommand_port = {free_port(socket.SOCK_DGRAM)}\n"
    file.write_text(text + "[checks]\ncontrol_rate = 0.5\n")  # other tests run beside it
    return folder


def begin(folder, words):
    """Start a command of the page, with a shorter flight or study."""
    environment, words = dict(os.environ), list(words)
    while "=" in words[0]:
        key, _, value = words.pop(0).partition("=")
        environment[key] = value
    if words[0] == "flockwire":
        whole = "--faults" in words or ("--host" in words and "--duration" not in words)
        shorter = [] if whole else SHORTER.get(words[1], [])
        line = [sys.executable, "-m", "flockwire_operator", *words[1:], *shorter]
    else:
        line = [sys.executable, *words[1:]]
    return subprocess.Popen(
        line, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def ended(process, status=0):
    """Wait for a command's end, and return what it printed."""
    printed, _ = process.communicate(timeout=2 * PATIENCE)
    assert process.returncode == status, printed
    return printed


VIRTUAL = ("fault_campaign", "formation_changes", "own_law", "paper", "person_walks_through")


@pytest.mark.parametrize("example", VIRTUAL, indirect=True)
def test_the_commands_of_a_virtual_example_run(example):
    written = commands(example.name)
    assert written
    for words in written:
        if words[1] != "study":  # the file of a study is read by a test of the page
            assert "well" in ended(begin(example, words))
