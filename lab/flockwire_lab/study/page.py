"""The study as one HTML page without other files (templates/study.html), beside study.json and its figures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flockwire_analysis.report import render
from flockwire_core.swarm.model import Swarm

from flockwire_lab.study.findings import Findings, label, quantity
from flockwire_lab.study.flight import QUANTITIES

if TYPE_CHECKING:
    from flockwire_analysis.figures.drawing import Picture  # with matplotlib

SUCCESS = ("", "runs", "success", "95 % interval", "failed")
FIGURES = ("", "figure", "50 %", "95 %", "99 %", "worst", "its seed")


def write_study(findings: Findings, swarm: Swarm, out: Path, pdf: bool) -> None:
    """Write study.json, study.html and the figures (PNG, perhaps PDF too) into the folder `out`. Raises OSError."""
    content = json.dumps(findings.as_json(), indent=2, allow_nan=False)
    (out / "study.json").write_text(content + "\n", encoding="utf-8")
    from flockwire_lab.study.figures import draw  # noqa: PLC0415  (matplotlib takes a second to import)

    (out / "study.html").write_text(page(findings, draw(findings, swarm, out, pdf)), encoding="utf-8")


def page(findings: Findings, pictures: Sequence[Picture]) -> str:
    """Return the page with its pictures inside; all text is escaped."""
    plan = findings.plan
    return render(
        "flockwire_lab.study",
        "study.html",
        name=findings.swarm.replace("_", " "),
        subtitle=f"{len(findings.results)} virtual flights of {plan.duration:g} s; study seed {plan.seed}",
        runs=len(findings.results),
        failures=findings.failures,
        success=(SUCCESS, success_rows(findings)),
        figures=(FIGURES, figure_rows(findings)),
        pictures=pictures,
        worst=worst_rows(findings),
        plan=json.dumps(plan.model_dump(mode="json"), indent=2),
    )


def success_rows(findings: Findings) -> Iterable[tuple[str, ...]]:
    """Yield the cells of each row of the table of success."""
    for row in findings.rows:
        failed = ", ".join(f"{count} x {name}" for name, count in row.failed.items())
        interval = f"{100 * row.low:.2f} to {100 * row.high:.2f} %"
        yield label(row.point), str(row.runs), f"{100 * row.rate:.2f} %", interval, failed or "none"


def figure_rows(findings: Findings) -> Iterable[tuple[str, ...]]:
    """Yield the cells of each row of the table of figures."""
    for row in findings.rows:
        for one in QUANTITIES:
            quantiles = row.figures[one.key]
            if quantiles is not None:
                values = (quantiles.p50, quantiles.p95, quantiles.p99, quantiles.worst)
                cells = (quantity(value, one.unit) for value in values)
                yield label(row.point), one.text, *cells, str(quantiles.worst_seed)


def worst_rows(findings: Findings) -> Iterable[tuple[str, ...]]:
    """Yield seed, grid point, result and the command that repeats it of each of the worst runs."""
    for result in findings.worst:
        point = label(dict(findings.plan.points[result.point]))
        verdict = result.reason or f"ok; {result.margin:.2f} x the safety distance"
        yield str(result.seed), point, verdict, findings.again(result).get("command", "")
