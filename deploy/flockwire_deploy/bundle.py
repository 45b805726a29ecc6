"""`--target systemd`: a folder for each host with its units and its other files; installed without internet."""

from __future__ import annotations

import os
import shutil
import tarfile
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.command_line import FilePaths, arguments
from flockwire_core.wire.plan import Plan

from flockwire_deploy.files import has_law, key_files, template, write, write_keys, write_swarm
from flockwire_deploy.wheels import Wheels, read_wheels

CREDENTIALS = "%d"  # systemd's word for the folder of a unit's own keys


class Folders(NamedTuple):
    """The folders of a swarm on its hosts, separate from other swarms', also for the program."""

    program: str
    configuration: str
    state: str  # below /var/lib


def folders(plan: Plan) -> Folders:
    """Return the folders of the swarm on its hosts."""
    return Folders(
        f"/opt/flockwire/{plan.swarm.name}", f"/etc/flockwire/{plan.swarm.name}", f"flockwire/{plan.swarm.name}"
    )


def target_name(plan: Plan) -> str:
    """Return the name of the unit that starts and ends all processes of a host."""
    return f"flockwire-{plan.swarm.name}.target"


def units(plan: Plan, host: str, program: str = "") -> dict[str, str]:
    """Return the text of each unit of `host`, by its name; `program` is the folder of another installation."""
    here, where = plan.processes_on(host), folders(plan)
    paths = FilePaths(f"{where.configuration}/swarm/swarm.toml", CREDENTIALS, f"/var/lib/{where.state}")
    names = {identity: f"flockwire-{plan.swarm.name}-{identity}.service" for identity in here}
    service, target = template("process.service.j2"), template("swarm.target.j2")
    found = {
        names[identity]: service.render(
            swarm=plan.swarm.name,
            identity=identity,
            line=[f"{program or where.program}/bin/flockwire", *arguments(plan, identity, paths, dated=True)],
            after=[names[other] for other in here if _outlasts(plan, other, identity)],
            target=target_name(plan),
            keys=key_files(plan, identity),
            folders=where,
            writes=plan.rows[identity].records,
        )
        for identity in here
    }
    return found | {target_name(plan): target.render(swarm=plan.swarm.name, host=host, units=list(names.values()))}


def _outlasts(plan: Plan, one: str, other: str) -> bool:
    """Return whether `one` ends after `other` and starts before it; all wait for a router."""
    if {one, other}.intersection(plan.routers):
        return one in plan.routers and other not in plan.routers
    return plan.rows[one].rank > plan.rows[other].rank


SUMS = "SHA256SUMS"


def write_bundles(plan: Plan, swarm_file: Path, keys: Path, out: Path, wheels: Path, playbook: bool) -> str:
    """Write a folder for each host, and what brings them there; returns the next step. Raises InputError, OSError."""
    held, law, hosts = read_wheels(wheels), plan.swarm.control.law, tuple(plan.swarm.hosts)
    if not has_law(plan.swarm) and not held.install(law.partition(":")[0]):
        remedy = "build one into that folder, or put its file beside the swarm file"
        raise InputError(f"control.law = {law!r}: no wheel in --wheels contains it; {remedy}")
    if idle := next((host for host in hosts if not plan.processes_on(host)), None):
        raise InputError(f"hosts.{idle}: runs nothing; name it as a drone's host, give it processes, or remove it")
    for host in hosts:
        _write_host(plan, host, out / host, swarm_file, keys, held)
    _remove_others(plan, out)
    if not playbook:
        return f"copy each of {', '.join(hosts)} to its host, and there: sudo ./install.sh"
    _write_playbook(plan, out)
    return f"ansible-playbook -i {out / 'inventory.yaml'} {out / 'playbook.yaml'}"


def _remove_others(plan: Plan, out: Path) -> None:
    """Remove the bundles, with their keys, of hosts that the swarm no longer has."""
    for unit in list(out.glob(f"*/units/{target_name(plan)}")):
        folder = unit.parents[1]
        copied = f" on {folder.name}\n" not in unit.read_text(encoding="utf-8")  # made by the user under another name
        if folder.name not in plan.swarm.hosts and not copied:
            shutil.rmtree(folder)
            packed(folder).unlink(missing_ok=True)


def _write_host(plan: Plan, host: str, folder: Path, swarm_file: Path, keys: Path, wheels: Wheels) -> None:
    for part in ("units", "swarm"):
        shutil.rmtree(folder / part, ignore_errors=True)
    by_wheel = wheels.install(plan.swarm.control.law.partition(":")[0])
    write_swarm(plan.swarm, swarm_file, folder / "swarm", law=not by_wheel)
    for name, text in units(plan, host).items():
        write(folder / "units" / name, text)
    write_keys(plan, keys, plan.processes_on(host), folder / "keys")
    wheels.copy(folder / "wheels")
    write(folder / "requirements.txt", wheels.requirements())
    script = template("install.sh.j2").render(
        host=host, swarm=plan.swarm.name, folders=folders(plan), target=target_name(plan), wheels=wheels
    )
    write(folder / "install.sh", script, 0o755)
    files = (path for path in sorted(folder.rglob("*"), key=str) if path.is_file() and path != folder / SUMS)
    sums = (f"{sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}\n" for path in files)
    write(folder / SUMS, "".join(sums))


def _write_playbook(plan: Plan, out: Path) -> None:
    """Write the files of `--target ansible`: inventory.yaml and playbook.yaml.

    They are beside the bundles in `out`, each of which becomes one file to copy. Only its owner may read it, because it
    has private keys.
    """
    hosts = {name: host.address for name, host in plan.swarm.hosts.items()}
    for host in hosts:
        file = packed(out / host)
        file.unlink(missing_ok=True)  # others may be able to read an older one
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "wb") as stream, tarfile.open(fileobj=stream, mode="w") as archive:
            archive.add(out / host, arcname=".")
    write(out / "inventory.yaml", template("inventory.yaml.j2").render(swarm=plan.swarm.name, hosts=hosts))
    write(out / "playbook.yaml", template("playbook.yaml.j2").render(swarm=plan.swarm.name))


def packed(folder: Path) -> Path:
    """Return the tar file of a bundle."""
    return folder.with_name(f"{folder.name}.tar")
