"""A summary's key figures as lines of text, of one flight or of several side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flockwire_analysis.summary import Summary

COLUMN = 12  # characters that a flight's column has at least


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


def beside(names: Sequence[str], summaries: Sequence[Summary]) -> Iterator[str]:
    """Yield the lines of a table of several flights' key figures, a column for each, headed by its name."""
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
    width = max(COLUMN, *(len(name) + 2 for name in names))
    yield f"{'':<30}" + "".join(f"{name:>{width}}" for name in names)
    for what, values in rows.items():
        yield f"{what:<30}" + "".join(f"{'unknown' if v is None else f'{v:.4g}':>{width}}" for v in values)


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _millimetres(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres * 1000:.1f} mm"
