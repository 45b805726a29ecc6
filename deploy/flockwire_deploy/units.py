"""The systemd units of one host: a service for each of its processes, from the same plan as `up`."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_core.wire.command_line import FilePaths, arguments
from flockwire_core.wire.plan import Plan

from flockwire_deploy.files import template

CREDENTIALS = "%d"  # systemd's word for the folder of a unit's own keys


class Folders(NamedTuple):
    """The folders of a swarm on its hosts, separate from other swarms', also for the program."""

    program: str
    configuration: str
    state: str  # below /var/lib

    @property
    def paths(self) -> FilePaths:
        """The file paths of a process."""
        return FilePaths(f"{self.configuration}/swarm/swarm.toml", CREDENTIALS, f"/var/lib/{self.state}")


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
    names = {identity: f"flockwire-{plan.swarm.name}-{identity}.service" for identity in here}
    service, target = template("process.service.j2"), template("swarm.target.j2")
    found = {
        names[identity]: service.render(
            swarm=plan.swarm.name,
            identity=identity,
            line=[f"{program or where.program}/bin/flockwire", *arguments(plan, identity, where.paths, dated=True)],
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


def key_files(plan: Plan, identity: str) -> tuple[str, ...]:
    """Return the names of the key files that `identity` needs."""
    return (*(f"{name}.crt" for name in plan.authorities), f"{identity}.crt", f"{identity}.key")
