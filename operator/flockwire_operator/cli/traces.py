"""Commands that read traces: `report`, `view`, `animate`, `recover`, `export`, `compare`."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from flockwire_operator.cli.inputs import refuse, refused
from flockwire_operator.station.terminal.progress import progress

app = typer.Typer()
TraceFile = Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")]
View = StrEnum("View", {"ABOVE": "above", "SIDE": "side", "SPACE": "3-D"})  # from where a picture shows a flight
Form = StrEnum("Form", ["CSV", "PARQUET"])  # of tables


@app.command()
def report(
    trace: TraceFile,
    out: Annotated[Path | None, typer.Option(help="Folder for the report [the trace's].")] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write each figure as PDF too.")] = False,
) -> None:
    """Draw the figures of a trace; write report.html and summary.json."""
    from flockwire_analysis.report import write_report  # noqa: PLC0415

    from flockwire_operator.cli.verdict import print_figures  # noqa: PLC0415

    folder = out or trace.parent
    with progress("reads the trace, draws its figures"):
        summary = _trace(folder, lambda: write_report(trace, folder, pdf))
    failures = print_figures(summary)
    print(f"  report: {folder / 'report.html'}")
    if failures:
        refuse("; ".join(failures), 1)


@app.command()
def view(
    trace: TraceFile,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="The page [replay.html, beside the trace].")
    ] = None,
) -> None:
    """Write the flight as a page that plays it: from above, from the side, in 3-D (one file, without network)."""
    from flockwire_analysis.replay import NAME, write_replay  # noqa: PLC0415
    from flockwire_analysis.summary import summarise  # noqa: PLC0415

    file = out or trace.parent / NAME
    if file.suffix != ".html":
        refuse(f"--out = {file}: must end with .html")
    with progress("reads the trace"):
        found = _trace(file, lambda: _read(trace))
        print(_trace(file, lambda: write_replay(found, summarise(found), file)))


@app.command()
def animate(
    trace: TraceFile,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.gif|FILE.mp4", help="The file [flight.gif, beside the trace].")
    ] = None,
    seconds: Annotated[float, typer.Option(min=2.0, max=60.0, help="Length of the moving picture.")] = 10.0,
    view: Annotated[View, typer.Option(help="From where it is seen.")] = View.ABOVE,
    width: Annotated[int, typer.Option(min=200, max=2000, metavar="PIXELS", help="Of the picture.")] = 455,
) -> None:
    """Write the flight as a moving picture: GIF, 3 MB at most, or MP4 where ffmpeg is installed."""
    from flockwire_analysis.figures.animation import animate as write  # noqa: PLC0415  (matplotlib)

    file = out or trace.parent / "flight.gif"
    if file.suffix not in (".gif", ".mp4"):
        refuse(f"--out = {file}: must end with .gif or .mp4")
    with progress("reads the trace, draws its frames"):
        print(_trace(file, lambda: write(_read(trace), file, seconds, view, width)))


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
    messages = _trace(target, lambda: make_whole(trace, target))
    print(f"flockwire: {messages} messages recovered into {target}")


@app.command()
def export(
    trace: TraceFile,
    out: Annotated[Path | None, typer.Option(help="Folder for the tables [tables, beside the trace].")] = None,
    form: Annotated[Form, typer.Option("--format", help="Parquet needs the extra parquet.")] = Form.CSV,
) -> None:
    """Write a trace as tables: poses, estimates, commands, telemetry, errors, events."""
    from flockwire_analysis.export import write_csv, write_parquet  # noqa: PLC0415  (numpy)

    write = write_csv if form is Form.CSV else write_parquet
    folder = out or trace.parent / "tables"
    for path in _trace(folder, lambda: write(_read(trace), folder)):
        print(path)


@app.command()
def compare(
    flights: Annotated[list[Path], typer.Argument(metavar="TRACE...", help="Traces; a folder: all in it.")],
    out: Annotated[Path, typer.Option(help="Folder for tables and figures.")] = Path("runs/comparison"),
) -> None:
    """Compare flights, or groups of flights: key figures, means with 95 % intervals, paired tests against the first."""
    from flockwire_analysis.comparison import as_csv, as_latex, as_text, comparison, groups_of  # noqa: PLC0415  (scipy)
    from flockwire_analysis.figures.comparison import MOST  # noqa: PLC0415  (matplotlib)
    from flockwire_analysis.figures.comparison import compare as draw  # noqa: PLC0415
    from flockwire_analysis.summary import summarise  # noqa: PLC0415

    files = [_flights_of(one) for one in flights]
    traces = _trace(out, lambda: [{name: _read(path) for name, path in one.items()} for one in files])
    names = _names(flights)
    groups = groups_of(names, [{name: summarise(trace) for name, trace in one.items()} for one in traces])
    rows = comparison(groups)
    print("\n".join(as_text(groups, rows)))
    with refused(out):
        out.mkdir(parents=True, exist_ok=True)
        (out / "comparison.csv").write_text(as_csv(groups, rows), encoding="utf-8")
        (out / "comparison.tex").write_text(as_latex(groups, rows), encoding="utf-8")
    print(out / "comparison.csv", out / "comparison.tex", sep="\n")
    if len(names) > MOST:
        print(f"flockwire: no figures: they can show {MOST} flights or groups, not {len(names)}", file=sys.stderr)
        return
    for path in _trace(out, lambda: draw([list(one.values()) for one in traces], names, out)):
        print(path)


def _flights_of(path: Path) -> dict[str, Path]:
    """Return the traces of one argument by name: the file, or all below a folder by their place in it."""
    if not path.is_dir():
        return {"": path}
    found = {str(trace.parent.relative_to(path)): trace for trace in sorted(path.rglob("trace.mcap"))}
    if not found:
        refuse(f"{path}: has no trace.mcap, nor has any folder below it")
    return found


def _names(paths: list[Path]) -> list[str]:
    """Return distinct names of traces and folders: the last parts of their paths, as many as needed.

    A file trace.mcap has the name of its folder.
    """
    named = (path if path.is_dir() else path.parent if path.stem == "trace" else path.with_suffix("") for path in paths)
    parts = [path.resolve().parts for path in named]
    for count in range(1, max(map(len, parts)) + 1):
        names = ["/".join(one[-count:]) for one in parts]
        if len(set(names)) == len(names):
            return names
    return [f"{k}: {name}" for k, name in enumerate(names, 1)]


def _read(path: Path) -> Any:  # noqa: ANN401  (a Trace; its package is large)
    """Return the trace in `path`; say what is missing of it."""
    from flockwire_analysis.reading import read_trace  # noqa: PLC0415  (numpy)

    found = read_trace(path)
    if found.lost_bytes:
        print(f"flockwire: missing: {found.lost_bytes} bytes of {path} are incomplete", file=sys.stderr)
    return found


def _trace(into: Path, work: Any) -> Any:  # noqa: ANN401  (it passes through whatever `work` returns)
    """Do `work` on a trace; a bad trace, or a file that cannot be read or written `into` a place, ends the program."""
    try:
        return work()
    except OSError as error:
        refuse(f"{error.filename or into}: {error.strerror}" if error.strerror else str(error))
    except ValueError as error:
        refuse(str(error))
