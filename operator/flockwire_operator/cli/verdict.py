"""How a flight went: prints its figures, where its report is, and the verdict, which is the exit status."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from flockwire_core.extras import lacking
from flockwire_core.swarm.wording import printable

from flockwire_operator.station.terminal.interrupts import LEFT_EARLY
from flockwire_operator.station.terminal.progress import progress

if TYPE_CHECKING:
    from flockwire_analysis.key_figures import Summary
    from flockwire_analysis.tracking import ErrorFigures


def conclude(failure: str, out: Path, trace_due: bool = True, verbose: bool = False) -> int:
    """Write the report of the flight in `out`, print its figures, all if `verbose`, and verdict; returns the status.

    A failure to read the trace or to write the report also fails the flight. There is no report while the recorder
    still writes.
    """
    trace = out / "trace.mcap"
    failures = [failure] if failure else []
    if LEFT_EARLY in failure:
        print(f"  no report yet; the trace grows: {trace}")
    elif trace.exists():
        failures += _report(trace, out, verbose)
    elif trace_due:
        failures.append("there is no trace")
    return verdict(failures)


def verdict(failures: Iterable[str]) -> int:
    """Print the verdict, with all `failures` in the last line; returns the exit status."""
    reasons = printable("; ".join(failures))
    if reasons:
        print(f"flockwire: the flight failed: {reasons}", file=sys.stderr)
        return 1
    print("flockwire: all well")
    return 0


def _report(trace: Path, out: Path, verbose: bool) -> Iterable[str]:
    """Print the figures of `trace` and write its report into `out`; yields why the flight failed."""
    from flockwire_analysis.reading import read_trace  # noqa: PLC0415  (numpy)
    from flockwire_analysis.report import write_files  # noqa: PLC0415
    from flockwire_analysis.summary import summarise  # noqa: PLC0415

    try:
        with progress("reads the trace"):
            read = read_trace(trace)
    except (OSError, ValueError) as error:
        yield f"the trace cannot be read: {error}"
        return
    summary = summarise(read)
    if read.was_ordered_up:
        yield from print_figures(summary, verbose)
    else:  # every check would fail
        yield "it ended before take-off"
    try:
        with progress("draws the figures"):
            write_files(read, summary, out)
    except OSError as error:
        yield f"the report cannot be written: {out}: {error.strerror}"
    except Exception as error:  # its libraries are large, and may fail in any way
        if isinstance(error, ModuleNotFoundError) and (line := lacking(error)):
            print(f"  no report: {line}")
        else:
            yield f"the report cannot be written: {str(error) or type(error).__name__}"
    else:
        print(f"  report: {out / 'report.html'}")


def print_figures(summary: Summary, verbose: bool = True) -> tuple[str, ...]:
    """Print the key figures and the checks, or a summary; returns a sentence for each failed check."""
    for line in key_figures(summary) if verbose else brief_figures(summary):
        print(f"  {printable(line)}")  # names of bodies and drones are a trace's
    return summary.failures()


def brief_figures(summary: Summary) -> Iterator[str]:
    """Yield the formation error, what failed, and how many checks passed."""
    yield _errors("formation", summary.formation_error_m)
    yield from _filter(summary)
    judged = [check for check in summary.checks if check.judged]
    yield from (f"FAIL {check.sentence()}" for check in judged if not check.ok)
    yield from (f"missing: {sentence}" for sentence in summary.missing)
    yield f"{'checks':<22}{sum(check.ok for check in judged)} of {len(judged)} passed (--verbose lists them)"


def key_figures(summary: Summary) -> Iterator[str]:
    """Yield the key figures of a flight and its checks, a line each."""
    for name, figures in (("observation", summary.observation_error_m), ("formation", summary.formation_error_m)):
        yield _errors(name, figures)
    yield from _filter(summary)
    latency = summary.latency_ms["pose_to_command"]
    if latency.p50 is not None and latency.p99 is not None:
        yield f"{'pose to command':<22}{latency.p50:.2f} ms p50, {latency.p99:.2f} ms p99"
    if summary.left_out:
        yield f"{'left out':<22}{', '.join(summary.left_out)}"
    for check in summary.checks:
        yield f"{('ok  ' if check.ok else 'FAIL') if check.judged else 'off '} {check.sentence()}"
    for sentence in summary.missing:
        yield f"missing: {sentence}"


def _filter(summary: Summary) -> Iterator[str]:
    if summary.filter:
        yield f"{'safety filter':<22}{summary.filter}"


def _errors(name: str, figures: ErrorFigures) -> str:
    settled = "never settled" if figures.settled_s is None else f"settled after {figures.settled_s:.1f} s"
    if figures.max_tail is figures.settled_s is None:
        return f"{name + ' error':<22}not measured"
    errors = f"{_millimetres(figures.max_tail)} at most, {_millimetres(figures.rms_tail)} rms"
    return f"{name + ' error':<22}{errors} in the last 30 %, {settled}"


def _millimetres(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres * 1000:.1f} mm"
