"""The command line of each process of a swarm."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_core.wire.plan import Plan


class FilePaths(NamedTuple):
    """The file paths of a process, on its machine or in its container."""

    swarm_file: str
    keys: str
    out: str


def arguments(plan: Plan, identity: str, paths: FilePaths, dated: bool = False) -> list[str]:
    """Return the arguments of `flockwire` that run `identity`; `dated`: the recorder runs for several flights."""
    row, member = plan.rows[identity], plan.members[identity]
    line = [row.kind, paths.swarm_file]
    if plan.is_named_by_id(identity):
        line.append(str(member.drone))
    line += ["--keys", paths.keys]
    if row.records:
        line += ["--out", paths.out, *(["--dated"] if dated else [])]
    return line
