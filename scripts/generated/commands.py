"""The page of all commands, from what `flockwire` itself parses."""

from __future__ import annotations

from argparse import SUPPRESS, Action
from collections.abc import Iterator
from itertools import chain
from typing import Any, NamedTuple

import typer
from flockwire_operator.cli.kinds import KINDS, parser_of
from flockwire_operator.cli.main import SECTIONS, app

HEAD = """# Command line

<!-- made by scripts/document from the commands themselves; change those -->

`flockwire COMMAND --help` prints the same. The exit status is 0 if all is well, 1 if the flight failed a check (the
last line gives the reason), 2 for bad usage or a bad swarm file. The last commands run one process of a swarm each;
`up`, systemd and containers start them.
"""


class Argument(NamedTuple):
    """One argument or option of a command."""

    usage: str  # its part of the command's usage; empty for an option
    name: str
    help: str


class Command(NamedTuple):
    """One command."""

    name: str
    help: str
    arguments: tuple[Argument, ...]


def commands() -> Iterator[Command]:
    """Yield every command, in the order of `flockwire --help`."""
    group: Any = typer.main.get_command(app)
    for name in chain(*SECTIONS.values()):
        command = group.commands[name]
        if name in KINDS:
            actions = parser_of(KINDS[name])._actions
            arguments = tuple(_of_process(one) for one in actions if one.help != SUPPRESS and one.dest != "help")
        else:
            context = command.make_context(name, [], resilient_parsing=True)
            arguments = tuple(_of_command(one, context) for one in command.params if not one.hidden)
        yield Command(name, command.help.strip(), arguments)


def _of_process(action: Action) -> Argument:
    name = ", ".join(action.option_strings)
    if not name:
        return Argument(str(action.metavar), str(action.metavar), action.help or "")
    value = "" if action.nargs == 0 else f" {action.metavar or action.dest.upper()}"
    return Argument("", name + value, action.help or "")


def _of_command(parameter: Any, context: Any) -> Argument:  # noqa: ANN401  (typer has no public types of these)
    name, text = parameter.get_help_record(context)
    usage = " ".join(part.replace("{", "").replace("}", "") for part in parameter.get_usage_pieces(context))
    return Argument("" if parameter.param_type_name == "option" else usage, name, text)


def commands_page() -> str:
    """Return the page."""
    return HEAD + "".join(_section(command) for command in commands())


def _section(command: Command) -> str:
    options = "[OPTIONS]" if any(not one.usage for one in command.arguments) else ""
    usage = " ".join(filter(None, ("flockwire", command.name, *(one.usage for one in command.arguments), options)))
    rows = "".join(f"| `{_cell(one.name)}` | {_cell(one.help)} |\n" for one in command.arguments)
    table = f"\n| | |\n|---|---|\n{rows}" if rows else ""
    return f"\n## {command.name}\n\n```text\n{usage}\n```\n\n{command.help}\n{table}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
