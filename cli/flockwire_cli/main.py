"""The `flockwire` command: the contract between the project and its users' scripts.

Exit status: 0 all well; 1 a flight failed, its reason on the last line; 2 bad usage or a bad swarm file.
"""

from __future__ import annotations

import typer

from flockwire_cli import flights, kinds, orders, tello_sim, traces

app = typer.Typer(
    help="Distributed edge runtime for formation flight: one process per drone, on Zenoh.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for part in (flights, orders, kinds, traces, tello_sim):
    app.add_typer(part.app)
