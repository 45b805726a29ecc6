"""The consensus example as a program in C++ and in Octave flies as the law in Python does."""

from __future__ import annotations

import shutil
import socket
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_lab.world import World
from waiting import wait_until

FOLDER = Path(__file__).parents[2] / "laws/elsewhere"
LONG = 60.0  # s until a program serves


def flown(control: dict) -> np.ndarray:
    """Return the true positions of all drones, m, in the order in which they were published."""
    table = tomllib.loads((FOLDER / "consensus.toml").read_text()) | {"control": control, "folder": str(FOLDER)}
    found: list[tuple[float, float, float]] = []

    def take(published):
        if published.key.kind == "truth":
            found.append(published.sample.message().position)

    outcome = World(parse_swarm(table, "test.toml"), 1, 12.0, tap=take).run()
    assert outcome.failure == ""
    return np.array(found)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def program(name: str, folder: Path) -> list[str]:
    """Return the command of an example, or skip the test."""
    needed = {"consensus.cpp": "g++", "consensus.m": "octave-cli"}[name]
    if shutil.which(needed) is None:
        pytest.skip(f"{needed} is not installed")
    if name.endswith(".m"):
        if subprocess.run([needed, "-q", "--eval", "pkg load sockets"], capture_output=True, check=False).returncode:
            pytest.skip("octave has no package sockets (Debian: octave-sockets)")
        return [needed, "-q", str(FOLDER / name)]
    binary = folder / "consensus"
    subprocess.run([needed, "-O2", "-Wall", "-Wextra", "-Werror", "-o", binary, FOLDER / name], check=True)
    return [str(binary)]


def is_served(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.long
@pytest.mark.parametrize("name", ["consensus.cpp", "consensus.m"])
def test_it_flies_as_the_law_in_python(name, tmp_path):
    information = tomllib.loads((FOLDER / "consensus.toml").read_text())["control"]["information"]
    port = free_port()
    with subprocess.Popen([*program(name, tmp_path), str(port)], cwd=tmp_path) as process:
        try:
            wait_until(lambda: is_served(port), LONG)
            elsewhere = flown({"law": f"tcp:{port}", "parameters": {"gain": 1.0}, "information": information})
        finally:
            process.kill()
    here = flown({"law": "consensus", "parameters": {"gain": 1.0}})
    assert elsewhere.shape == here.shape
    assert np.abs(elsewhere - here).max() < 1e-9


def test_the_example_is_a_swarm():
    table = tomllib.loads((FOLDER / "consensus.toml").read_text())
    assert Swarm.model_validate(table).control.elsewhere
