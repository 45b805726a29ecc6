"""Commands that write what a user goes on to edit: `init`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Annotated

import typer
from flockwire.swarm.page import schema
from flockwire_station.initial import SCHEMA, swarm_text

from flockwire_cli.inputs import refuse

app = typer.Typer()


@app.command()
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The swarm file to write.")] = Path("swarm.toml"),
    drones: Annotated[int, typer.Option(min=2, max=200, help="The number of drones, with the leader.")] = 4,
) -> None:
    """Write a swarm file with comments, and a schema for editors beside it."""
    name = re.sub(r"\W", "_", file.stem, flags=re.ASCII)
    if not name[0].isalpha():
        name = f"swarm_{name}"
    if file.exists():
        refuse(f"FILE = {file}: exists; name a new one")
    try:
        file.write_text(swarm_text(name[:64], drones), encoding="utf-8")
        beside = file.parent / SCHEMA
        beside.parent.mkdir(exist_ok=True)
        beside.write_text(json.dumps(schema(), indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        refuse(f"FILE = {file}: cannot write there: {error.strerror}")
    print(
        f"flockwire: {file}: {drones} drones; next: flockwire check {file}, flockwire sim {file}, flockwire up {file}"
    )
