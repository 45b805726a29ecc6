"""Commands that write files for the user to edit: `init`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from flockwire_station.initial import write_swarm

from flockwire_cli.inputs import refuse

app = typer.Typer()


@app.command()
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The swarm file to write.")] = Path("swarm.toml"),
    drones: Annotated[int, typer.Option(min=2, max=200, help="The number of drones, with the leader.")] = 4,
) -> None:
    """Write a swarm file with comments, and a schema for editors beside it."""
    if file.exists():
        refuse(f"FILE = {file}: exists; name a new one")
    try:
        write_swarm(file, drones)
    except OSError as error:
        refuse(f"FILE = {file}: cannot write there: {error.strerror}")
    print(
        f"flockwire: {file}: {drones} drones; next: flockwire check {file}, flockwire sim {file}, flockwire up {file}"
    )
