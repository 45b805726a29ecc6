"""`--target ansible`: the bundles of all hosts, an inventory from [hosts], and a playbook that brings them out."""

from __future__ import annotations

import os
import tarfile
from pathlib import Path

from flockwire.wire.plan import Plan

from flockwire_cli.deploy.bundle import packed
from flockwire_cli.deploy.files import write
from flockwire_cli.deploy.pages import template


def write_playbook(plan: Plan, out: Path) -> None:
    """Write inventory.yaml and playbook.yaml beside the bundles in `out`, each of which becomes one file to copy."""
    hosts = {name: host.address for name, host in plan.swarm.hosts.items()}
    for host in hosts:
        _pack(out / host, packed(out / host))
    write(out / "inventory.yaml", template("inventory.yaml.j2").render(swarm=plan.swarm.name, hosts=hosts))
    write(out / "playbook.yaml", template("playbook.yaml.j2").render(swarm=plan.swarm.name))


def _pack(folder: Path, file: Path) -> None:
    """Put what is in `folder` into `file`, which has private keys and so is its owner's alone."""
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(descriptor, "wb") as stream, tarfile.open(fileobj=stream, mode="w") as archive:
        archive.add(folder, arcname=".")
