"""The `flockwire` command: the contract between the project and its users' scripts.

Exit status: 0 success; 1 a flight failed, with the reason on the last line; 2 bad usage or a bad swarm file.
"""

from __future__ import annotations

from typing import Annotated

import typer

from flockwire_cli import airframes, files, flights, kinds, orders, traces, tracker
from flockwire_cli.arguments import application
from flockwire_cli.entry import print_version

app = application()
for part in (files, flights, orders, airframes, traces, tracker):
    app.add_typer(part.app)


def _process(context: typer.Context) -> None:
    raise typer.Exit(kinds.run(str(context.info_name), context.args))


for kind, row in kinds.KINDS.items():
    unread = {"ignore_unknown_options": True, "allow_extra_args": True}  # `kinds` reads them
    app.command(kind, help=row.help, add_help_option=False, context_settings=unread)(_process)


def _version(wanted: bool) -> None:
    if wanted:
        print_version()
        raise typer.Exit


@app.callback()
def options(
    wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Read the options before the command."""
