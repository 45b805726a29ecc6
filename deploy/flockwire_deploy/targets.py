"""The output of `flockwire deploy` for each target."""

from __future__ import annotations

import os
from enum import StrEnum
from ipaddress import IPv4Network
from pathlib import Path

from flockwire.wire.plan import Plan

from flockwire_deploy.bundle import Bundler, write_playbook
from flockwire_deploy.compose import aboard, compose_file, outside
from flockwire_deploy.files import (
    DeployError,
    refuse_keys_in_use,
    remove_other_keys,
    write,
    write_keys,
    write_swarm,
)
from flockwire_deploy.wheels import read_wheels

NOT_ROOT = (10001, 10001)  # the user of root's containers: the image's own


class Target(StrEnum):
    """Where a swarm is deployed to."""

    COMPOSE = "compose"
    SYSTEMD = "systemd"
    ANSIBLE = "ansible"


def write_compose(plan: Plan, swarm_file: Path, keys: Path, out: Path, within: IPv4Network | None) -> str:
    """Write the folder of a swarm of containers on one machine; returns the next step. Raises DeployError, OSError."""
    if line := outside(plan.swarm):
        raise DeployError(line)
    text = compose_file(plan, within)
    for identity in aboard(plan):
        refuse_keys_in_use(keys, out / "keys" / identity)
    write(out / "compose.yaml", text)
    write_swarm(plan.swarm, swarm_file, out / "swarm")
    caller = (os.getuid(), os.getgid())
    owner = caller if caller[0] else NOT_ROOT
    for identity in aboard(plan):
        write_keys(plan, keys, [identity], out / "keys" / identity, None if owner == caller else owner)
    remove_other_keys(out / "keys", aboard(plan))
    (out / "runs").mkdir(exist_ok=True)
    if owner != caller:
        os.chown(out / "runs", *owner)
    # A project's name may not have capitals, and both compose versions read it only from this file.
    write(out / ".env", f"COMPOSE_PROJECT_NAME={plan.swarm.name.lower()}\nFLOCKWIRE_USER={owner[0]}:{owner[1]}\n")
    return f"docker compose -f {out / 'compose.yaml'} up"


def write_bundles(plan: Plan, swarm_file: Path, keys: Path, out: Path, wheels: Path, playbook: bool) -> str:
    """Write a folder for each host, and what brings them there; returns the next step. Raises DeployError, OSError."""
    hosts = Bundler(plan, swarm_file, keys, read_wheels(wheels)).write(out)
    if not playbook:
        return f"copy each of {', '.join(hosts)} to its host, and there: sudo ./install.sh"
    write_playbook(plan, out)
    return f"ansible-playbook -i {out / 'inventory.yaml'} {out / 'playbook.yaml'}"
