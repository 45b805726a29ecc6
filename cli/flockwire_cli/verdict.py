"""The figures of a flight on the terminal."""

from __future__ import annotations

from pathlib import Path

from flockwire_recorder.summary import Summary


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
    for check in summary.checks:
        print(f"  {'ok  ' if check.ok else 'FAIL'} {check.sentence()}")
    for sentence in summary.missing:
        print(f"  missing: {sentence}")
    return summary.failures()


def _millimetres(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres * 1000:.1f} mm"
