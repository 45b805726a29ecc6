"""A container engine for tests: whether one answers, the image of this tree, and a swarm of containers."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FLOCKWIRE = Path(sys.prefix, "bin/flockwire")
IMAGE = "flockwire-test"
OPERATOR = f"{IMAGE}-operator"
BASE = "flockwire-base"  # scripts/base_image makes it
SWARM = """
name = "lab"
formation = { kind = "circle", radius = 1.5, rate = 0.3 }
graph = { edges = [[0, 1], [1, 2]] }
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] },
  { id = 1, start = [1.5, 0.0, 0.0], host = "pi1" },
  { id = 2, start = [-1.5, 1.0, 0.0], host = "pi2" },
]
hosts = { station = {}, pi1 = {}, pi2 = {} }
"""
PULLED = "python:3.11-slim-bookworm"


def run(
    *line: object, timeout: float = 60.0, check: bool = True, **options: object
) -> subprocess.CompletedProcess[str]:
    """Run a command; its output is in the failure."""
    done = subprocess.run(
        [str(word) for word in line], capture_output=True, text=True, timeout=timeout, check=False, **options
    )
    if check:
        assert done.returncode == 0, f"{line}: {done.stdout[-2000:]}{done.stderr[-4000:]}"
    return done


def missing() -> str:
    """Return why this machine has no containers, empty when it has."""
    if shutil.which("docker") is None:
        return "there is no docker"
    try:
        answers = run("docker", "version", check=False, timeout=10).returncode == 0
    except subprocess.TimeoutExpired:
        answers = False
    if not answers:
        return "no container engine answers"
    return "" if compose() else "there is neither docker compose nor docker-compose"


def compose() -> list[str]:
    """Return the compose command of this machine, empty when it has none."""
    if run("docker", "compose", "version", check=False).returncode == 0:
        return ["docker", "compose"]
    return ["docker-compose"] if shutil.which("docker-compose") else []


def base_image() -> str:
    """Return the image that others are built on, after making it; skips where that cannot be done.

    Tests of containers and of hosts run side by side: one makes it, the other waits.
    """
    with (Path(tempfile.gettempdir()) / "flockwire-base.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        base = next((name for name in (BASE, PULLED) if _has(name)), None)
        if base is None and shutil.which("debootstrap") and os.geteuid() == 0:
            run(ROOT / "scripts/base_image", timeout=400)
            base = BASE
    if base is None:
        pytest.skip(f"there is no base image: neither {PULLED} here nor debootstrap, as root, to make one")
    return base


def image() -> str:
    """Return the image of this tree's processes, after building it and that of the operator."""
    run(ROOT / "scripts/image", timeout=590, env={**os.environ, "BASE": base_image(), "FLOCKWIRE_IMAGE": IMAGE})
    return IMAGE


def _has(name: str) -> bool:
    return run("docker", "image", "inspect", name, check=False).returncode == 0


class Swarm:
    """A swarm of containers in the folder that `flockwire deploy` wrote."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.runs = folder / "runs"
        self._compose = [*compose(), "-f", str(folder / "compose.yaml")]
        self._environment = {**os.environ, "FLOCKWIRE_IMAGE": IMAGE}

    def __call__(self, *words: object, timeout: float = 120.0, check: bool = True, **more: str) -> str:
        """Run a compose command with the environment `more`; returns what it printed."""
        environment = {**self._environment, **more}
        done = run(*self._compose, *words, timeout=timeout, check=check, env=environment, cwd=self.folder)
        return done.stdout + done.stderr

    def container(self, identity: str) -> str:
        """Return the id of the container of a process."""
        return self("ps", "--all", "--quiet", identity).split()[0]

    def inspected(self, identity: str) -> dict:
        return json.loads(run("docker", "inspect", self.container(identity)).stdout)[0]

    def log(self, identity: str) -> str:
        return self("logs", "--no-color", identity)

    def order(self, verb: str) -> str:
        """Give an order in a container of the operator."""
        command = ["run", "--rm", "-T", "operator", verb, "/swarm/swarm.toml", "--keys", "/keys"]
        return self(*command, check=False)


def until(condition, seconds: float, what: str):
    """Wait until `condition` returns something, and return it."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if found := condition():
            return found
        time.sleep(0.2)
    raise AssertionError(f"not within {seconds} s: {what}")
