"""Commands that read a trace: `report`, `recover`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from flockwire_cli.arguments import refuse

app = typer.Typer()


@app.command()
def report(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the report [the trace's].")] = None,
) -> None:
    """Draw the figures of a trace; write report.html and summary.json."""
    from flockwire_recorder.report import write_report  # noqa: PLC0415

    from flockwire_cli.verdict import print_summary  # noqa: PLC0415

    folder = out or trace.parent
    failures = print_summary(_trace(lambda: write_report(trace, folder)), folder)
    if failures:
        print(f"flockwire: {'; '.join(failures)}", file=sys.stderr)
        raise typer.Exit(1)


@app.command()
def recover(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace that was cut off.")],
    out: Annotated[Path | None, typer.Option(help="The whole trace to write [TRACE-recovered.mcap].")] = None,
) -> None:
    """Make a trace whole that was cut off by a crash."""
    from flockwire_recorder.recover import recover as make_whole  # noqa: PLC0415

    target = out or trace.with_name(f"{trace.stem}-recovered.mcap")
    if target.exists():
        refuse(f"--out = {target}: exists; name a new file")
    found = _trace(lambda: make_whole(trace, target))
    print(f"flockwire: {found.messages} messages recovered into {target}")


def _trace(work: Any) -> Any:  # noqa: ANN401  (it passes through whatever `work` returns)
    """Do `work` on a trace; what is wrong with the trace ends the program."""
    try:
        return work()
    except (OSError, ValueError) as error:
        refuse(str(error))
