"""Writes the report of a trace: summary.json, figures and report.html."""

from __future__ import annotations

import json
from pathlib import Path

from flockwire_analysis.page import page
from flockwire_analysis.reading import read_trace
from flockwire_analysis.recorded import Trace
from flockwire_analysis.summary import Summary, summarise


def write_report(trace: Path, out: Path, vector: bool = False) -> Summary:
    """Read `trace` with its other parts, and write its report as `write_files` does.

    A truncated trace is read up to its end. Raises ValueError for a file that is not a trace of a swarm, OSError if one
    cannot be read or written.
    """
    read = read_trace(trace)
    summary = summarise(read)
    write_files(read, summary, out, vector)
    return summary


def write_files(trace: Trace, summary: Summary, out: Path, vector: bool = False) -> None:
    """Write summary.json, the figures as PNG (and PDF if `vector`) and report.html of a flight into the folder `out`.

    Raises OSError.

    The report includes probe.json of `flockwire probe`, if it is in that folder.
    """
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(json.dumps(summary.as_json(), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    from flockwire_analysis.figures import draw  # noqa: PLC0415  (matplotlib takes a second to import)

    pictures = draw(trace, out, vector)
    probe = out / "probe.json"
    results = json.loads(probe.read_text(encoding="utf-8")) if probe.exists() else None
    (out / "report.html").write_text(page(trace, summary, pictures, results), encoding="utf-8")
