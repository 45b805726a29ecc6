"""The table of a comparison of laws: as text, CSV, LaTeX and PDF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flockwire_analysis.expenditure import COSTS
from flockwire_analysis.figures.drawing import STYLE
from flockwire_analysis.report import UNKNOWN
from flockwire_analysis.tables import aligned, commas, escape, tabular
from matplotlib import rc_context
from matplotlib.figure import Figure

from flockwire_lab.study.file import Study
from flockwire_lab.study.findings import label, quantiles
from flockwire_lab.study.flight import Result

HEADINGS = ("law", "success", "settled, s", "tail, mm", *(f"{one.heading}, {one.unit}" for one in COSTS))
COLUMNS = (  # those of figures: key, quantile, factor
    ("settled_s", "p50", 1.0), ("formation_tail_m", "p95", 1000.0), *((one.key, "p50", 1.0) for one in COSTS),
)  # fmt: skip
CAPTION = (
    "Success: flights that pass all checks. Settled, and the four on the right: medians over all flights, of which a "
    "failed one counts as the worst; per follower. Tail: the bound that 95 % of the flights keep."
)
Row = tuple[str, ...]


def rows(plan: Study, results: Sequence[Result]) -> list[Row]:
    """Return a row for each law: law, success, settling time, tail, and what it costs."""
    found = []
    for number, point in enumerate(plan.points):
        here = [result for result in results if result.point == number and result.run < plan.runs]
        success = f"{sum(result.ok for result in here)} of {len(here)}"
        found.append((_law(point[0][1]), success, *(_cell(here, *column) for column in COLUMNS)))
    return found


def text(table: Sequence[Row]) -> str:
    """Return the table as lines of text."""
    return "\n".join(aligned((HEADINGS, *table)))


def write(table: Sequence[Row], out: Path) -> list[Path]:
    """Write laws.txt, laws.csv, laws.tex and laws.pdf into `out`; returns their paths. Raises OSError."""
    texts = {"laws.txt": f"{text(table)}\n", "laws.csv": commas((HEADINGS, *table)), "laws.tex": latex(table)}
    for name, content in texts.items():
        (out / name).write_text(content, encoding="utf-8")
    _draw(table, out / "laws.pdf")
    return [*(out / name for name in texts), out / "laws.pdf"]


def latex(table: Sequence[Row]) -> str:
    """Return the table for a paper; it needs the package booktabs."""
    heads, *lines = ([escape(cell) for cell in row] for row in (HEADINGS, *table))
    return f"% {CAPTION}\n{tabular(heads, lines)}"


def _draw(table: Sequence[Row], path: Path) -> None:
    with rc_context(STYLE):
        figure = Figure(figsize=(11.0, 0.9 + 0.3 * len(table)))
        axes = figure.add_subplot()
        axes.axis("off")
        drawn = axes.table(cellText=[list(row) for row in table], colLabels=list(HEADINGS), loc="upper center")
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(9)
        drawn.auto_set_column_width(list(range(len(HEADINGS))))
        for (row, column), cell in drawn.get_celld().items():
            cell.set_linewidth(0.0 if row else 0.6)
            cell.visible_edges = "B" if row == 0 else ""
            cell.set_text_props(ha="left" if column == 0 else "right")
        figure.savefig(path, bbox_inches="tight", metadata={"CreationDate": None})


def _cell(results: Sequence[Result], key: str, share: str, scale: float) -> str:
    found = quantiles([(result.seed, result.figures.get(key)) for result in results], True) if results else None
    value = getattr(found, share) if found is not None else None
    return UNKNOWN if value is None else f"{scale * value:.3g}" if scale * value < 1000.0 else f"{scale * value:.0f}"


def _law(control: object) -> str:
    """Return the name of a law with its parameters."""
    assert isinstance(control, dict)  # noqa: S101  (a comparison varies the table alone)
    given = control.get("parameters") or {}
    return str(control["law"]) + (f" ({label(given)})" if given else "")
