"""Commands that run one process of a swarm, as systemd and compose start them: one for each kind of process."""

from __future__ import annotations

import os
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any

import typer
from flockwire import clock
from flockwire.wire.plan import Plan
from flockwire.wire.processes import PROCESSES, Process

from flockwire_cli.arguments import (
    FaultsFile,
    Keys,
    Number,
    SwarmFile,
    application,
    faults_of,
    keys_folder,
    load,
    refuse,
    refuse_a_second_trace,
)

Out = Annotated[Path, typer.Option(help="Folder for trace.mcap.")]
Dated = Annotated[
    bool, typer.Option("--dated", help="A folder named by the time below OUT; one that a crash cut off goes on.")
]
Protocol = Annotated[
    str | None,
    typer.Option(
        metavar="P", help="Of a tracker: natnet, vrpn, qualisys. Without the swarm: bodies stand at the starts."
    ),
]
TookOff = Annotated[int | None, typer.Option(hidden=True, help="When faults count from, Unix ns.")]

app = application()


def _register(row: Process) -> None:
    """Add the command of one kind of process, with the arguments that it takes."""

    def run(**given: Any) -> None:  # noqa: ANN401  (typer passes what the signature below declares)
        raise typer.Exit(_serve(row, **given))

    taken: dict[str, tuple[Any, Any]] = {"swarm": (SwarmFile, Parameter.empty)}
    if row.numbered:
        taken["number"] = (Number, Parameter.empty)
    taken["keys"] = (Keys, None)
    if row.records:
        taken |= {"out": (Out, Path("runs/recording")), "dated": (Dated, False)}
    if row.alone:
        taken["protocol"] = (Protocol, None)
    if row.faults or row.records:  # who records them marks them in the trace
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
    dated: bool = False,
    faults: Path | None = None,
    took_off: int | None = None,
    protocol: str | None = None,
) -> int:
    from flockwire.runtime.ending import LIFELINE  # noqa: PLC0415  (asyncio)
    from flockwire.runtime.job import Job, serve  # noqa: PLC0415  (zenoh)

    plan = load(swarm)
    if protocol is not None:
        return _alone(row, plan, protocol)
    identity = _identity(plan, row, number)
    if dated:
        out = _dated(out, plan)
    elif row.records and LIFELINE not in os.environ:  # a child of `up` that is restarted goes on in the same flight
        from flockwire_recorder.parts import same_flight  # noqa: PLC0415  (the trace's format)

        if not same_flight(out, plan.swarm, clock.utc()):
            refuse_a_second_trace(out)
    return serve(
        Job(
            plan,
            identity,
            keys_folder(swarm, plan, keys),
            swarm.read_text(encoding="utf-8"),
            out,
            faults_of(faults, plan),
            took_off,
        )
    )


def _dated(out: Path, plan: Plan) -> Path:
    from flockwire_recorder.folders import dated_folder  # noqa: PLC0415  (only a recorder needs it)

    try:
        return dated_folder(out, plan.swarm, clock.local())
    except OSError as error:
        refuse(f"--out = {out}: cannot look there: {error.strerror}")


def _alone(row: Process, plan: Plan, protocol: str) -> int:
    """Run a process without its swarm."""
    from flockwire.loading import load_object  # noqa: PLC0415

    if protocol not in plan.swarm.gateway.twins:
        refuse(f"--protocol = {protocol!r}: must be one of {', '.join(plan.swarm.gateway.twins)}")
    try:
        load_object(row.alone)(plan.swarm, protocol)
    except OSError as error:
        refuse(str(error))
    except KeyboardInterrupt:
        pass
    return 0


def _identity(plan: Plan, row: Process, number: int | None) -> str:
    members = {plan.members[identity].drone: identity for identity in plan.of_kind(row.kind)}
    if not members:
        refuse(f"{plan.swarm.name} has no {row.kind}: only a swarm with {row.only_if} has one")
    if row.numbered:
        if number not in members:
            refuse(f"ID = {number}: must be one of {list(members)}")
        return members[number]
    return next(iter(members.values()))


for kind in PROCESSES:
    if kind.started:
        _register(kind)
