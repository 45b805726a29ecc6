"""The study as one small HTML page that needs nothing else, beside study.json and its figures."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template

from flockwire.swarm.model import Swarm

from flockwire_sim.study.findings import QUANTITIES, Findings, Row
from flockwire_sim.study.labels import label, quantity

PAGE = Template("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>$name: study</title><style>
  :root { color-scheme: light dark; --line: #8883; }
  body { font: 15px/1.55 system-ui, sans-serif; max-width: 1080px; margin: 0 auto; padding: 40px 20px; }
  h1 { font-size: 28px; margin: 0; } h2 { font-size: 18px; margin: 32px 0 8px; }
  .wide { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
  th { text-align: left; font-weight: 500; opacity: .7; font-size: 13px; white-space: nowrap; }
  th, td { padding: 5px 14px 5px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
  img { width: 100%; background: #fff; border-radius: 10px; margin: 8px 0; } code { overflow-wrap: anywhere; }
  pre { overflow-x: auto; font-size: 13px; }
</style></head><body>
<h1>$name</h1><p>$subtitle</p>
<h2>Success</h2><div class="wide"><table>$success</table></div>
<h2>Figures</h2><p>What half, 95 %, 99 % and all of the runs keep to; a run without a value counts as the worst.</p>
<div class="wide"><table>$figures</table></div>
$pictures
<h2>Worst runs</h2><div class="wide"><table>$worst</table></div>
<details><summary>The study</summary><pre>$plan</pre></details>
</body></html>
""")


def write_study(findings: Findings, swarm: Swarm, out: Path) -> None:
    """Write study.json, study.html and the PNG figures into the folder `out`. Raises OSError."""
    content = json.dumps(findings.as_json(), indent=2, allow_nan=False)
    (out / "study.json").write_text(content + "\n", encoding="utf-8")
    from flockwire_sim.study.figures import draw  # noqa: PLC0415  (matplotlib takes a second to import)

    (out / "study.html").write_text(page(findings, draw(findings, swarm, out)), encoding="utf-8")


def page(findings: Findings, pictures: Sequence[Path]) -> str:
    """Return the page with its pictures inside."""
    plan = findings.plan
    return PAGE.substitute(
        name=escape(findings.swarm.replace("_", " ")),
        subtitle=escape(
            f"{len(findings.results)} virtual flights of {plan.duration:g} s, {findings.failures} failed; "
            f"study seed {plan.seed}"
        ),
        success=_table(("", "runs", "success", "95 % interval", "failed"), map(_success, findings.rows)),
        figures=_table(("", "figure", "50 %", "95 %", "99 %", "worst", "its seed"), _figures(findings)),
        pictures="".join(f'<img alt="{p.stem}" src="data:image/png;base64,{_base64(p)}">' for p in pictures),
        worst=_table(("seed", "grid point", "what", "again"), _worst(findings)),
        plan=escape(json.dumps(plan.model_dump(mode="json"), indent=2)),
    )


def _success(row: Row) -> tuple[str, ...]:
    failed = ", ".join(f"{count} x {name}" for name, count in row.failed.items())
    interval = f"{100 * row.low:.2f} to {100 * row.high:.2f} %"
    return label(row.point), str(row.runs), f"{100 * row.rate:.2f} %", interval, failed or "none"


def _figures(findings: Findings) -> Iterable[tuple[str, ...]]:
    for row in findings.rows:
        for one in QUANTITIES:
            spread = row.figures[one.key]
            if spread is not None:
                values = (spread.p50, spread.p95, spread.p99, spread.worst)
                cells = (quantity(value, one.unit) for value in values)
                yield label(row.point), one.text, *cells, str(spread.worst_seed)


def _worst(findings: Findings) -> Iterable[tuple[str, ...]]:
    for result in findings.worst:
        point = label(dict(findings.plan.points[result.point]))
        verdict = result.reason or f"ok; {result.margin:.2f} x the safety distance"
        yield str(result.seed), point, verdict, findings.again(result).get("command", "")


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["".join(f"<th>{escape(head)}</th>" for head in heads)]
    lines += ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
    return "".join(f"<tr>{line}</tr>" for line in lines)


def _base64(path: Path) -> str:
    return b64encode(path.read_bytes()).decode()
