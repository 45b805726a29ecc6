"""A summary's key figures as lines of text."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_analysis.summary import Summary


def lines(summary: Summary) -> Iterator[str]:
    """Yield the key figures of a flight and its checks, a line each."""
    for name, figures in (("observation", summary.observation_error_m), ("formation", summary.formation_error_m)):
        settled = "never settled" if figures.settled_s is None else f"settled after {figures.settled_s:.1f} s"
        errors = f"{_millimetres(figures.max_tail)} at most, {_millimetres(figures.rms_tail)} rms"
        yield f"{name + ' error':<22}{errors} in the last 30 %, {settled}"
    latency = summary.latency_ms["pose_to_command"]
    if latency.p50 is not None and latency.p99 is not None:
        yield f"{'pose to command':<22}{latency.p50:.2f} ms p50, {latency.p99:.2f} ms p99"
    if summary.left_out:
        yield f"{'left out':<22}{', '.join(summary.left_out)}"
    for check in summary.checks:
        yield f"{'ok  ' if check.ok else 'FAIL'} {check.sentence()}"
    for sentence in summary.missing:
        yield f"missing: {sentence}"


def _millimetres(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres * 1000:.1f} mm"
