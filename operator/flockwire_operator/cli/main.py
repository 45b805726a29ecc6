"""The `flockwire` command: the contract between the project and its users' scripts.

Exit status: 0 success; 1 a flight failed, with the reason on the last line; 2 bad usage or a bad swarm file.
"""

from __future__ import annotations

from typing import Annotated, Any

import typer
from flockwire_core.swarm.airframes import AIRFRAMES
from typer.core import TyperGroup

from flockwire_operator.cli import devices, files, flights, kinds, orders, studies, traces
from flockwire_operator.cli.arguments import application

OF_AIRFRAMES = tuple(row.command.rpartition(":")[2].replace("_", "-") for row in AIRFRAMES if row.command)
SECTIONS = {
    "A swarm": ("new", "init", "check", "convert", "keys", "deploy"),
    "Flights": ("up", "sim", "study", "compare-laws", "conduct", "status", "console", "teleop"),
    "Orders in flight": ("start", "formation", "hold", "land", "stop"),
    "Traces of flights": ("report", "view", "animate", "compare", "export", "recover"),
    "Trackers, drones, links": ("tracker", "align", "identify", *OF_AIRFRAMES, "probe"),
    "Single processes, which `up` starts together": tuple(kinds.KINDS),
}


class SectionedGroup(TyperGroup):
    """Lists the commands in SECTIONS, which name each of them."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401  (as above)
        """Write a section for each kind of command."""
        width = max(map(len, self.commands))
        for title, names in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), (self.commands[name].help or "").strip()) for name in names])


app = application(SectionedGroup)
for part in (files, flights, studies, orders, devices, traces):
    app.add_typer(part.app)


def _process(context: typer.Context) -> None:
    raise typer.Exit(kinds.run(str(context.info_name), context.args))


for kind, row in kinds.KINDS.items():
    unread = {"ignore_unknown_options": True, "allow_extra_args": True}  # `kinds` reads them
    app.command(kind, help=row.help, add_help_option=False, context_settings=unread)(_process)


@app.callback()
def options(
    wanted: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,  # entry.py does
) -> None:
    """Read the options before the command."""
