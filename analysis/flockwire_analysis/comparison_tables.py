"""The table of a comparison as text, CSV and LaTeX."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence

from flockwire_analysis.comparison import Difference, Group, Mean, Row

WIDTH = 12  # characters of a column, at least
PER_GROUP = ("flights", "mean", "low", "high")
_NEGATIVE = re.compile(r"-(?=\d)")  # the sign of a number
PER_PAIR = ("pairs", "difference", "low", "high", "p")


def as_text(groups: Sequence[Group], rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of a table: a column for each group, and one for each difference to the first."""
    compared = any(difference is not None for row in rows for difference in row.differences)
    heads = [group.name for group in groups]
    heads += [f"{group.name} - {groups[0].name}" for group in groups[1:]] if compared else []
    lines = []
    for row in rows:
        unit = f", {row.quantity.unit}" if row.quantity.unit else ""
        cells = [_mean(mean) for mean in row.means]
        cells += [_difference(one) for one in row.differences] if compared else []
        lines.append((row.quantity.name + unit, cells))
    widths = [max(WIDTH, len(head) + 2, *(len(cells[k]) + 2 for _, cells in lines)) for k, head in enumerate(heads)]
    yield f"{'':<32}" + "".join(f"{head:>{width}}" for head, width in zip(heads, widths, strict=True))
    for name, cells in lines:
        yield f"{name:<32}" + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))


def as_csv(groups: Sequence[Group], rows: Sequence[Row]) -> str:
    """Return the table as CSV, with all digits; unknown values are empty."""
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    head = [f"{group.name}: {name}" for group in groups for name in PER_GROUP]
    head += [f"{group.name} - {groups[0].name}: {name}" for group in groups[1:] for name in PER_PAIR]
    writer.writerow(["quantity", "unit", *head])
    for row in rows:
        cells: list[object] = [row.quantity.name, row.quantity.unit]
        for mean in row.means:
            cells += [0, "", "", ""] if mean is None else [mean.flights, mean.mean, mean.low, mean.high]
        for one in row.differences:
            cells += [0, "", "", "", ""] if one is None else [one.pairs, one.mean, one.low, one.high, one.p]
        writer.writerow("" if cell is None else cell for cell in cells)
    return written.getvalue()


def as_latex(groups: Sequence[Group], rows: Sequence[Row]) -> str:
    """Return the table as LaTeX's tabular, for a paper; needs the package booktabs."""
    compared = len(groups) > 1 and any(one is not None for row in rows for one in row.differences)
    heads = ["", *(_escaped(group.name) for group in groups)]
    heads += [f"{_escaped(group.name)} $-$ {_escaped(groups[0].name)}" for group in groups[1:]] if compared else []
    lines = [f"\\begin{{tabular}}{{l{'r' * (len(heads) - 1)}}}", "\\toprule", " & ".join(heads) + " \\\\", "\\midrule"]
    for row in rows:
        unit = f" [{row.quantity.unit}]" if row.quantity.unit else ""
        cells = [row.quantity.name + unit, *(_mean(mean) for mean in row.means)]
        cells += [_difference(one) for one in row.differences] if compared else []
        lines.append(" & ".join(_NEGATIVE.sub("$-$", cell) for cell in cells) + " \\\\")
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}"]) + "\n"


def _mean(mean: Mean | None) -> str:
    if mean is None:
        return "unknown"
    if mean.low is None or mean.high is None:
        return _number(mean.mean)
    return f"{_number(mean.mean)} [{_number(mean.low)}, {_number(mean.high)}]"


def _difference(one: Difference | None) -> str:
    if one is None:
        return "no pairs"
    p = "equal" if one.p is None else f"p = {one.p:.2g}"
    return f"{_number(one.mean)} [{_number(one.low)}, {_number(one.high)}], {p}"


def _number(value: float) -> str:
    return f"{value:.4g}"


def _escaped(text: str) -> str:
    return "".join(f"\\{sign}" if sign in "_%&#$" else sign for sign in text)
