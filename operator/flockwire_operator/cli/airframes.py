"""Commands for single drones: `identify` measures an airframe; rows of the airframe table add other commands."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import typer
from flockwire_core.objects import load_object
from flockwire_core.runtime.standard_streams import unblocked
from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.model import uav

from flockwire_operator.cli.arguments import Keys, Number, SwarmFile
from flockwire_operator.cli.inputs import load, made_keys, own_folder, refuse, refused

app = typer.Typer()


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
