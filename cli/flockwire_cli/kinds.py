"""Commands that run one process of a swarm, as systemd and compose start them: one for each kind of process."""

from __future__ import annotations

import os
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any

import typer
from flockwire.wire.plan import Plan
from flockwire.wire.processes import PROCESSES, Process

from flockwire_cli.arguments import FaultsFile, Keys, Number, SwarmFile, faults_of, load, refuse, refuse_a_second_trace

Out = Annotated[Path, typer.Option(help="Folder for trace.mcap.")]
TookOff = Annotated[int | None, typer.Option(hidden=True, help="When faults count from, Unix ns.")]

app = typer.Typer()


def _register(row: Process) -> None:
    """Add the command of one kind of process, with the arguments that it takes."""

    def run(**given: Any) -> None:  # noqa: ANN401  (typer passes what the signature below declares)
        raise typer.Exit(_serve(row, **given))

    taken: dict[str, tuple[Any, Any]] = {"swarm": (SwarmFile, Parameter.empty)}
    if row.numbered:
        taken["number"] = (Number, Parameter.empty)
    taken["keys"] = (Keys, None)
    if row.records:
        taken["out"] = (Out, Path("runs/recording"))
    if row.faults:
        taken |= {"faults": (FaultsFile, None), "took_off": (TookOff, None)}
    run.__annotations__ = {name: kind for name, (kind, _) in taken.items()}
    run.__signature__ = Signature(  # type: ignore[attr-defined]
        [Parameter(n, Parameter.KEYWORD_ONLY, default=d, annotation=k) for n, (k, d) in taken.items()]
    )
    run.__doc__ = row.help
    app.command(row.kind)(run)


def _serve(
    row: Process,
    swarm: Path,
    number: int | None = None,
    keys: Path | None = None,
    out: Path = Path(),
    faults: Path | None = None,
    took_off: int | None = None,
) -> int:
    from flockwire.runtime.ending import LIFELINE  # noqa: PLC0415  (asyncio)
    from flockwire.runtime.job import Job, serve  # noqa: PLC0415  (zenoh)

    plan = load(swarm)
    identity = _identity(plan, row, number)
    if row.records and LIFELINE not in os.environ:  # a child of `up` that is restarted goes on in the same flight
        refuse_a_second_trace(out)
    return serve(Job(plan, identity, keys, swarm.read_text(encoding="utf-8"), out, faults_of(faults, plan), took_off))


def _identity(plan: Plan, row: Process, number: int | None) -> str:
    members = {plan.members[identity].drone: identity for identity in plan.of_kind(row.kind)}
    if row.numbered:
        if number not in members:
            refuse(f"ID = {number}: must be one of {list(members)}")
        return members[number]
    if not members:
        refuse(f"{plan.swarm.name} has no {row.kind}: only a swarm with {row.only_if} has one")
    return next(iter(members.values()))


for kind in PROCESSES:
    if kind.started:
        _register(kind)
