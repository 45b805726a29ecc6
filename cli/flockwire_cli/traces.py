"""Commands that read traces: `report`, `animate`, `recover`, `export`, `compare`."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from flockwire_station.terminal.progress import progress

from flockwire_cli.inputs import refuse, unwritable

app = typer.Typer()


class Form(StrEnum):
    """The formats of tables."""

    CSV = "csv"
    PARQUET = "parquet"


@app.command()
def report(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the report [the trace's].")] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write each figure as PDF too.")] = False,
) -> None:
    """Draw the figures of a trace; write report.html and summary.json."""
    from flockwire_analysis.report import write_report  # noqa: PLC0415

    from flockwire_cli.verdict import print_figures, print_place  # noqa: PLC0415

    folder = out or trace.parent
    with progress("reads the trace, draws its figures"):
        summary = _trace(lambda: write_report(trace, folder, pdf))
    failures = print_figures(summary)
    print_place(folder)
    if failures:
        print(f"flockwire: {'; '.join(failures)}", file=sys.stderr)
        raise typer.Exit(1)


@app.command()
def animate(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.gif", help="The file [flight.gif, beside the trace].")
    ] = None,
    seconds: Annotated[float, typer.Option(min=2.0, max=60.0, help="Length of the moving picture.")] = 10.0,
) -> None:
    """Write the flight from above as a moving picture (GIF, 3 MB at most)."""
    from flockwire_analysis.figures.animation import animate as write  # noqa: PLC0415  (matplotlib)
    from flockwire_analysis.reading import read_trace  # noqa: PLC0415

    file = out or trace.parent / "flight.gif"
    if file.suffix != ".gif":
        refuse(f"--out = {file}: must end with .gif")
    with progress("reads the trace, draws its frames"):
        print(_trace(lambda: write(read_trace(trace), file, seconds)))


@app.command()
def recover(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A truncated trace.")],
    out: Annotated[Path | None, typer.Option(help="The complete trace to write [TRACE-recovered.mcap].")] = None,
) -> None:
    """Repair a trace that was truncated by a crash."""
    from flockwire_recorder.recover import recover as make_whole  # noqa: PLC0415

    target = out or trace.with_name(f"{trace.stem}-recovered.mcap")
    if target.exists():
        refuse(f"--out = {target}: exists; name a new file")
    found = _trace(lambda: make_whole(trace, target))
    print(f"flockwire: {found.messages} messages recovered into {target}")


@app.command()
def export(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the tables [tables, beside the trace].")] = None,
    form: Annotated[Form, typer.Option("--format", help="Parquet needs `scripts/extra parquet`.")] = Form.CSV,
) -> None:
    """Write a trace as tables: poses, estimates, commands, telemetry, errors, events."""
    from flockwire_analysis.export import write_csv, write_parquet  # noqa: PLC0415  (numpy)
    from flockwire_analysis.reading import read_trace  # noqa: PLC0415

    write = write_csv if form is Form.CSV else write_parquet
    for path in _trace(lambda: write(read_trace(trace), out or trace.parent / "tables")):
        print(path)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")],
    second: Annotated[Path, typer.Argument(metavar="TRACE", help="Another one.")],
    out: Annotated[Path, typer.Option(help="Folder for the figures.")] = Path("runs/comparison"),
) -> None:
    """Overlay two flights in figures, and print their key figures side by side."""
    from flockwire_analysis.figures.comparison import compare as draw  # noqa: PLC0415  (matplotlib)
    from flockwire_analysis.key_figures import beside  # noqa: PLC0415
    from flockwire_analysis.reading import read_trace  # noqa: PLC0415
    from flockwire_analysis.summary import summarise  # noqa: PLC0415

    traces = _trace(lambda: (read_trace(first), read_trace(second)))
    names = _names(first, second)
    print("\n".join(beside(names, [summarise(trace) for trace in traces])))
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        unwritable(out, error)
    for path in _trace(lambda: draw(traces, names, out)):
        print(path)


def _names(first: Path, second: Path) -> tuple[str, str]:
    """Return distinct names of two traces: their folders, or else their file names."""
    folders = first.resolve().parent.name, second.resolve().parent.name
    return folders if folders[0] != folders[1] else (first.stem, second.stem)


def _trace(work: Any) -> Any:  # noqa: ANN401  (it passes through whatever `work` returns)
    """Do `work` on a trace; a bad trace ends the program."""
    try:
        return work()
    except (OSError, ValueError) as error:
        refuse(str(error))
