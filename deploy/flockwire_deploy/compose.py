"""`--target compose`: one service for each process of the plan, with its own keys, on the networks of its links.

As far as bridges allow, linked processes share a private network. Two drones' processes (an edge of the graph, or a
drone's agent and driver) share their own. Every other process has one network with all processes linked to it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from ipaddress import IPv4Network
from pathlib import Path
from typing import NamedTuple

from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.command_line import FilePaths, arguments
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR

from flockwire_deploy.files import (
    has_law,
    refuse_keys_in_use,
    remove_other_keys,
    template,
    write,
    write_keys,
    write_swarm,
)

PATHS = FilePaths("/swarm/swarm.toml", "/keys", "/runs")
CONDUCTED = ("--duration", "${DURATION:-40}", "--out", PATHS.out)
POOL = 30  # networks that fit in an engine's default address pools
RANGE = IPv4Network("10.224.0.0/12")  # subnets of more networks, unless the user names another range
NOT_ROOT = (10001, 10001)  # the user of root's containers: the image's own


class ContainerNetwork(NamedTuple):
    """One network: its name, members, and addresses unless the engine chooses them."""

    name: str
    members: tuple[str, ...]
    subnet: IPv4Network | None = None


def aboard(plan: Plan) -> tuple[str, ...]:
    """Return the processes of containers, in the order of the process table: all that `up` starts, and the operator."""
    return tuple(identity for identity in plan.identities if identity in plan.started or identity == OPERATOR.kind)


def networks(plan: Plan, within: IPv4Network | None = None) -> tuple[ContainerNetwork, ...]:
    """Return the networks of all containers, with subnets of `within` if given, or if they are many.

    Raises InputError if they do not fit.
    """
    spare = 4  # reserved addresses of a network: its own, broadcast, the engine's, one for a restarted container
    members = _members(plan)
    if within is None and len(members) <= POOL:
        return tuple(ContainerNetwork(name, on) for name, on in members.items())
    largest = max(len(on) for on in members.values()) + spare
    length = 32 - (largest - 1).bit_length()
    whole = within or RANGE
    if length < whole.prefixlen or 2 ** (length - whole.prefixlen) < len(members):
        raise InputError(f"--subnets = {whole}: has no room for {len(members)} networks of {largest} addresses")
    subnets = whole.subnets(new_prefix=length)
    return tuple(ContainerNetwork(name, on, next(subnets)) for name, on in members.items())


def _members(plan: Plan) -> dict[str, tuple[str, ...]]:
    place = {identity: rank for rank, identity in enumerate(aboard(plan))}
    found: dict[str, set[str]] = {}
    for one, rank in place.items():
        for other in plan.links[one]:
            if place.get(other, rank) < rank:
                found.setdefault(_name(plan, other, one), set()).update((one, other))
    return {name: tuple(sorted(on, key=place.__getitem__)) for name, on in found.items()}


def _name(plan: Plan, one: str, other: str) -> str:
    """Return the network of the link between two processes, given in the order of the table."""
    shared = next((name for name in (one, other) if plan.members[name].drone is None), None)
    return shared if shared is not None else f"{one}-{other}"


def outside(swarm: Swarm) -> str:
    """Return a line about an input that containers on private networks cannot have; empty without one."""
    remedy = "deploy with --target systemd, or fly it with `flockwire up`"
    if not has_law(swarm):
        which = f"control.law = {swarm.control.law!r}: the image has only {sorted(BUILT_IN)}"
        return f"{which}; put its file beside the swarm file, or {remedy}"
    if swarm.gateway.source != "simulated":
        return f"gateway.source = {swarm.gateway.source!r}: containers cannot reach a tracker; {remedy}"
    if swarm.driven:
        first = swarm.driven[0]
        which = f"{swarm.drone(first).airframe!r}: containers cannot reach such a drone, even if it is simulated"
        return f"drones.{first}.airframe = {which}; {remedy}"
    return ""


def compose_file(plan: Plan, within: IPv4Network | None = None) -> str:
    """Return the text of compose.yaml, its services in the order of the process table. Raises InputError."""
    nets = networks(plan, within)
    services = [
        {
            "identity": identity,
            "command": _command(plan, identity),
            "after": _after(plan, identity),
            "networks": [net.name for net in nets if identity in net.members],
            "writes": identity in (*plan.recorders, OPERATOR.kind),  # into the folder of runs
        }
        for identity in aboard(plan)
    ]
    page = template("compose.yaml.j2")
    return page.render(swarm=plan.swarm.name, services=services, networks=nets, operator=OPERATOR.kind, paths=PATHS)


def write_compose(plan: Plan, swarm_file: Path, keys: Path, out: Path, within: IPv4Network | None) -> str:
    """Write the folder of a swarm of containers on one machine; returns the next step. Raises InputError, OSError."""
    if line := outside(plan.swarm):
        raise InputError(line)
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


def _command(plan: Plan, identity: str) -> tuple[str, ...]:
    if identity == OPERATOR.kind:
        return ("conduct", PATHS.swarm_file, "--keys", PATHS.keys, *CONDUCTED)
    return tuple(arguments(plan, identity, PATHS, dated=True))


def _after(plan: Plan, identity: str) -> tuple[str, ...]:
    """Return the processes that end after `identity` and start before it: the next higher rank.

    The operator ends first: that lands the drones.
    """
    ranks = {other: -1 if other == OPERATOR.kind else plan.rows[other].rank for other in aboard(plan)}
    higher = min((rank for rank in ranks.values() if rank > ranks[identity]), default=None)
    return tuple(other for other, rank in ranks.items() if rank == higher)


IMAGES = ("flockwire", "flockwire-operator")  # of processes, of the operator


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
    patience = 10.0  # s for an answer
    try:
        told = subprocess.run(["docker", *arguments], capture_output=True, text=True, timeout=patience, check=False)  # noqa: S603, S607
    except subprocess.TimeoutExpired:
        return ""
    return told.stdout.strip() if told.returncode == 0 else ""
