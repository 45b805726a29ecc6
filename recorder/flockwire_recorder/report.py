"""Turns a trace into what a person, and a script, want to know of a flight."""

from __future__ import annotations

import json
from pathlib import Path

from flockwire_recorder.page import page
from flockwire_recorder.reading import read_trace
from flockwire_recorder.summary import Summary, summarise


def write_report(trace: Path, out: Path) -> Summary:
    """Read `trace` and write summary.json, the figures as PNG and report.html into the folder `out`.

    What `flockwire probe` left in that folder, probe.json, becomes a part of the report. A trace that was cut off is
    read as far as it goes. Raises ValueError for a file that is no trace of a swarm, OSError where one cannot be read
    or written.
    """
    read = read_trace(trace)
    summary = summarise(read)
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(json.dumps(summary.as_json(), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    from flockwire_recorder.figures import draw  # noqa: PLC0415  (matplotlib takes a second to import)

    pictures = draw(read, out)
    probe = out / "probe.json"
    results = json.loads(probe.read_text(encoding="utf-8")) if probe.exists() else None
    (out / "report.html").write_text(page(read, summary, pictures, results), encoding="utf-8")
    return summary
