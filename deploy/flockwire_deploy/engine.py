"""Checks whether this machine's container engine can run the swarm."""

from __future__ import annotations

import shutil
import subprocess

IMAGES = ("flockwire", "flockwire-operator")  # of processes, of the operator
PATIENCE = 10.0  # s for an answer


def obstacle() -> str:
    """Return why this machine's engine cannot run a swarm, with the remedy; empty if it can."""
    if shutil.which("docker") is None:
        return "there is no docker on this machine; install Docker Engine to fly the swarm here"
    engine = _ask("version", "--format", "{{.Server.Arch}}")
    if not engine:
        return "the container engine does not answer; start it (systemctl start docker), or join the group docker"
    for image in IMAGES:
        built = _ask("image", "inspect", "--format", "{{.Architecture}}", image)
        if not built:
            return f"the engine has no image {image!r}; scripts/image builds it"
        if built != engine:
            return (
                f"the image {image!r} is for {built}, the engine's machine is {engine}; build it there with "
                "scripts/image"
            )
    return ""


def _ask(*arguments: str) -> str:
    """Return docker's answer, empty if it fails."""
    try:
        told = subprocess.run(["docker", *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False)  # noqa: S603, S607
    except subprocess.TimeoutExpired:
        return ""
    return told.stdout.strip() if told.returncode == 0 else ""
