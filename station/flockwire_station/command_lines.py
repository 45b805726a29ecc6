"""The command line of a process: the same whether `up`, a container engine or systemd starts it."""

from __future__ import annotations

from typing import NamedTuple

from flockwire.wire.plan import Plan


class FilePaths(NamedTuple):
    """Where a process finds its files: paths on the machine, or in the container, that runs it."""

    swarm_file: str
    keys: str
    out: str


def arguments(plan: Plan, identity: str, paths: FilePaths, dated: bool = False) -> list[str]:
    """Return the arguments of `flockwire` that run `identity`; `dated`: what it writes outlasts one flight."""
    row, member = plan.rows[identity], plan.members[identity]
    line = [row.kind, paths.swarm_file]
    if row.numbered:
        line.append(str(member.drone))
    line += ["--keys", paths.keys]
    if row.records:
        line += ["--out", paths.out, *(["--dated"] if dated else [])]
    return line
