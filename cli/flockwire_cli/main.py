"""The `flockwire` command: the contract between the project and its users' scripts.

Exit status: 0 all well; 1 a flight failed, its reason on the last line; 2 bad usage or a bad swarm file.
"""

from __future__ import annotations

from typing import Annotated

import typer

from flockwire_cli import airframes, deploying, files, flights, kinds, orders, tello_sim, traces, tracker
from flockwire_cli.arguments import application

app = application()
for part in (files, flights, orders, deploying, kinds, airframes, traces, tello_sim, tracker):
    app.add_typer(part.app)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version  # noqa: PLC0415

        print(f"flockwire {version('flockwire')}")
        raise typer.Exit


@app.callback()
def options(
    wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take what stands before the command."""
