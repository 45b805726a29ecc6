"""Arguments of several commands, and an empty command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from flockwire_core.wire.plan import Plan
from typer.core import TyperGroup

from flockwire_operator.cli.inputs import refuse

SwarmFile = Annotated[Path, typer.Argument(metavar="SWARM", help="The swarm file (TOML).")]
Keys = Annotated[
    Path | None,
    typer.Option(envvar="FLOCKWIRE_KEYS", help="Folder of the certificates [.flockwire/NAME/keys beside SWARM]."),
]
FaultsFile = Annotated[Path | None, typer.Option(help="The faults to inject (TOML).")]
Without = Annotated[
    list[int] | None, typer.Option(metavar="ID", help="A drone to leave on the ground; may be repeated.")
]
Verbose = Annotated[
    bool, typer.Option("--verbose", help="Print all figures and checks, and obstacles that followers fly around.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON (docs/scripting.md has its keys).")]
Number = Annotated[int, typer.Argument(metavar="ID", help="The drone's id.")]


def application(group: type[TyperGroup] = TyperGroup) -> typer.Typer:
    """Return a command line without commands; its help, by `group`, and its errors are plain text."""
    return typer.Typer(
        cls=group,
        help="Distributed edge runtime for formation flight: one process per drone, on Zenoh.",
        no_args_is_help=True,
        context_settings={"help_option_names": ["-h", "--help"]},
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )


def left_out(plan: Plan, without: list[int] | None) -> tuple[int, ...]:
    """Return the drones to leave on the ground and print the consequences, or refuse if the graph does not allow it."""
    from flockwire_core.ground.absence import consequences, refusal  # noqa: PLC0415  (numpy)

    absent = tuple(sorted(set(without or ())))
    if cannot := refusal(plan.swarm, absent):
        refuse(cannot)
    for line in consequences(plan.swarm, absent):
        print(f"flockwire: {line}")
    return absent
