"""Commands that measure a device: `tracker`, `align`, and `identify` a drone; rows of the airframe table add others."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from flockwire_core.objects import load_object
from flockwire_core.runtime.standard_streams import unblocked
from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.wording import printable
from flockwire_core.wire.plan import Plan

from flockwire_operator.cli.arguments import AsJson, Keys, Number, SwarmFile
from flockwire_operator.cli.inputs import load, made_keys, own_folder, refuse, refused

if TYPE_CHECKING:
    from flockwire_core.domain.vector import Vector
    from flockwire_mocap.survey.inspection import BodyFigures, Inspection
    from flockwire_mocap.tracking import SourceState

Seconds = Annotated[float, typer.Option(min=0.5, max=60.0, help="Seconds to listen.")]

app = typer.Typer()


@app.command()
def tracker(swarm: SwarmFile, seconds: Seconds = 1.5, as_json: AsJson = False) -> None:
    """List the tracker's bodies with rate, jitter, latency, loss, and the problems to correct before a flight."""
    plan = load(swarm)
    inspection, state = _listen(plan, seconds)
    rows, problems = inspection.figures(), inspection.problems(state.trouble)
    if as_json:
        from flockwire_operator.station.answers import text  # noqa: PLC0415

        print(text({"bodies": [row._asdict() for row in rows], "counts": dict(state.counts), "problems": problems}))
    else:
        _print(rows, state)
    if problems:
        refuse("\n".join(problems), 1)
    if not as_json:
        print("all drones' bodies are present, tracked, still, and at their starts")


def _listen(plan: Plan, seconds: float) -> tuple[Inspection, SourceState]:
    from flockwire_mocap.survey.inspection import listen  # noqa: PLC0415

    with refused(bad=(OSError, ValueError)):
        return asyncio.run(listen(plan, seconds))


def _print(rows: Sequence[BodyFigures], state: SourceState) -> None:
    if rows:
        print(f"{'body':20}{'drone':>7}{'Hz':>8}{'jitter ms':>11}{'latency ms':>12}{'lost':>8}  position, m")
    for row in rows:
        print(_line(row))
    if state.counts:
        print(", ".join(f"{count} {printable(what)}" for what, count in state.counts))


def _line(row: BodyFigures) -> str:
    drone = "" if row.drone is None else str(row.drone)
    where = "not tracked" if row.position is None else "  ".join(f"{part:.3f}" for part in row.position)
    times = f"{row.rate:8.1f}{1000 * row.jitter:11.2f}{1000 * row.latency:12.2f}"
    return f"{printable(row.name):20}{drone:>7}{times}{row.lost:8.1%}  {where}"


@app.command()
def align(
    swarm: SwarmFile,
    at: Annotated[
        list[str] | None,
        typer.Option(metavar="BODY=X,Y,Z", help="A body at a known place, m [each drone's at its start]."),
    ] = None,
    seconds: Seconds = 1.5,
) -> None:
    """Find rotation and offset from the tracker's frame to the field's, from bodies at known places."""
    from flockwire_mocap.survey.alignment import align_bodies  # noqa: PLC0415

    plan = load(swarm)
    known = _places(plan, at or [])
    level = {"rotation": (0.0, 0.0, 0.0, 1.0), "offset": (0.0, 0.0, 0.0)}  # the tracker's frame is the field's
    gateway = plan.swarm.gateway.model_copy(update=level)
    inspection, state = _listen(Plan(plan.swarm.tracked_by(gateway)), seconds)
    seen = inspection.places()
    if state.trouble and not seen:
        refuse(state.trouble)
    with refused():
        found = align_bodies(seen, known)
    for name, residual in zip(known, found.residuals, strict=True):
        print(f"{name:20} {1000 * residual:7.1f} mm left")
    if found.doubtful:
        print("flockwire: warning: a body is at a wrong place, or two are exchanged", file=sys.stderr)
    print("", *found.table(), sep="\n")


def _places(plan: Plan, given: list[str]) -> dict[str, Vector]:
    """Return the known places by body."""
    swarm = plan.swarm
    if not given:
        return {str(swarm.body(i)): swarm.drone(i).start for i in swarm.flying}
    found: dict[str, Vector] = {}
    for text in given:
        name, _, place = text.rpartition("=")
        try:
            x, y, z = map(float, place.split(","))
        except ValueError:
            refuse(f"--at = {text!r}: must be BODY=X,Y,Z, in m")
        found[name] = (x, y, z)
    return found


@app.command()
def identify(
    swarm: SwarmFile,
    number: Number,
    out: Annotated[Path | None, typer.Option(help="Folder for figure and logs [runs/NAME-identify-ID-TIME].")] = None,
    body: Annotated[
        bool, typer.Option("--body", help="Only prove that the tracker's body is the drone's: climb, turn, land.")
    ] = False,
    keys: Keys = None,
) -> None:
    """Fly one drone to measure its gains, lag and dead time; print its table for the swarm file."""
    from flockwire_operator.station import identify as identifying  # noqa: PLC0415
    from flockwire_operator.station.excitation import Axis  # noqa: PLC0415
    from flockwire_operator.station.identification import IdentificationError  # noqa: PLC0415  (scipy)

    plan = load(swarm)
    loaded = plan.swarm
    if number not in plan.pilots:
        refuse(f"ID = {number}: must be one of {list(plan.pilots)}")
    if body and not loaded.row(number).turns:
        refuse(f"--body: {uav(number)} is of kind {loaded.row(number).kind!r}, which does not turn")
    axes = (Axis.CLOCKWISE,) if body else tuple(Axis)
    secrets = made_keys(swarm, plan, keys, plan.hosts[plan.pilots[number]])
    folder = own_folder(out, f"{loaded.name}-identify-{number}")
    try:
        with refused(folder), unblocked():
            core = asyncio.run(identifying.excite(plan, swarm, secrets, number, folder, axes))
            found = identifying.fits(core)
    except IdentificationError as error:
        refuse(f"identify failed: {error}", 1)
    if found:
        print("\n".join(identifying.described(found)), end="\n\n")
        figure = folder / "identification.png"
        identifying.draw(core.responses, found, figure)
        if body:
            print(f"the body {loaded.body(number)!r} climbed and turned as commanded: it belongs to {uav(number)}")
        elif not core.failure:
            print("\n".join(identifying.airframe_table(loaded, number, found)))
        print(f"\nflockwire: {figure}")
    if core.failure:
        refuse(f"identify failed: {core.failure}", 1)


for row in AIRFRAMES:
    if row.command:
        app.command()(refused(bad=ValueError)(unblocked()(load_object(row.command))))
