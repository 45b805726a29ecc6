"""How a flight went: its figures on the terminal, its report, and the exit status."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from flockwire.extras import lacking
from flockwire.wire.phase import Phase
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status

from flockwire_station.terminal.progress import progress

if TYPE_CHECKING:
    from flockwire_analysis.summary import Summary


def conclude(failure: str, out: Path, trace_due: bool = True) -> int:
    """Write the report of the flight in `out`, print its figures and verdict; returns the exit status.

    What keeps the trace from being read, or the report from being written, is one more reason why the flight failed.
    """
    trace = out / "trace.mcap"
    failures = [failure] if failure else []
    if trace.exists():
        failures += _report(trace, out)
    elif trace_due:
        failures.append("there is no trace")
    return verdict(failures)


def verdict(failures: Iterable[str]) -> int:
    """Print whether the flight went well, all `failures` in the last line; returns the exit status."""
    reasons = "; ".join(failures)
    if reasons:
        print(f"flockwire: the flight failed: {reasons}", file=sys.stderr)
        return 1
    print("flockwire: all well")
    return 0


def disk_full(plan: Plan, statuses: Mapping[str, Status]) -> str:
    """Return which recorder could not record the whole flight by its last status, empty when all could."""
    reports = {identity: statuses[identity].report for identity in plan.recorders if identity in statuses}
    return "; ".join(f"{identity}: {last.detail}" for identity, last in reports.items() if last.phase == Phase.FULL)


def _report(trace: Path, out: Path) -> Iterable[str]:
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
    yield from print_figures(summary)
    try:
        with progress("draws the figures"):
            write_files(read, summary, out)
    except OSError as error:
        yield f"the report cannot be written: {out}: {error.strerror}"
    except (ImportError, MemoryError) as error:  # its libraries are the largest
        if isinstance(error, ModuleNotFoundError) and (line := lacking(error)):
            print(f"  no report: {line}")
        else:
            yield f"the report cannot be written: {str(error) or 'not enough memory'}"
    else:
        print(f"  report: {out / 'report.html'}")


def print_summary(summary: Summary, out: Path) -> tuple[str, ...]:
    """Print the key figures, the checks and where the report is; returns a sentence for each check that failed."""
    failures = print_figures(summary)
    print(f"  report: {out / 'report.html'}")
    return failures


def print_figures(summary: Summary) -> tuple[str, ...]:
    """Print the key figures and the checks; returns a sentence for each check that failed."""
    for name, figures in (("observation", summary.observation_error_m), ("formation", summary.formation_error_m)):
        settled = "never settled" if figures.settled_s is None else f"settled after {figures.settled_s:.1f} s"
        print(f"  {name + ' error':<22}{_millimetres(figures.max_tail)} at most, {_millimetres(figures.rms_tail)} rms "
              f"in the last 30 %, {settled}")  # fmt: skip
    latency = summary.latency_ms["pose_to_command"]
    if latency.p50 is not None and latency.p99 is not None:
        print(f"  {'pose to command':<22}{latency.p50:.2f} ms p50, {latency.p99:.2f} ms p99")
    if summary.left_out:
        print(f"  {'left out':<22}{', '.join(summary.left_out)}")
    for check in summary.checks:
        print(f"  {'ok  ' if check.ok else 'FAIL'} {check.sentence()}")
    for sentence in summary.missing:
        print(f"  missing: {sentence}")
    return summary.failures()


def beside(names: tuple[str, ...], summaries: tuple[Summary, ...]) -> str:
    """Return the key figures of several flights as a table, a column for each."""
    rows: dict[str, list[float | None]] = {
        "formation error, tail, mm": [_times(1e3, s.formation_error_m.max_tail) for s in summaries],
        "observation error, tail, mm": [_times(1e3, s.observation_error_m.max_tail) for s in summaries],
        "settled after, s": [s.formation_error_m.settled_s for s in summaries],
        "smallest distance, m": [s.min_distance_uav_m for s in summaries],
        "to an obstacle, m": [s.min_distance_obstacle_m for s in summaries],
        "highest speed, m/s": [s.max_speed_m_s for s in summaries],
        "pose to command, p99, ms": [s.latency_ms["pose_to_command"].p99 for s in summaries],
        "failed checks": [float(len(s.failures())) for s in summaries],
    }
    width = max(12, *(len(name) + 2 for name in names))
    lines = [f"{'':<30}" + "".join(f"{name:>{width}}" for name in names)]
    for what, values in rows.items():
        lines.append(f"{what:<30}" + "".join(f"{'unknown' if v is None else f'{v:.4g}':>{width}}" for v in values))
    return "\n".join(lines)


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _millimetres(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres * 1000:.1f} mm"
