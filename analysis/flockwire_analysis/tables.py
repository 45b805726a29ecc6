"""A table of cells as text, as CSV, and for a paper in LaTeX."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

_WRITTEN = str.maketrans(
    {sign: f"\\{sign}" for sign in "_%&#${}"}
    | {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    | {"²": "$^2$", "\N{EN DASH}": "--"}
)


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table, whose first column is on the left."""
    first, *others = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([head.ljust(first), *(cell.rjust(width) for cell, width in zip(cells, others, strict=True))]).rstrip()
        for head, *cells in rows
    ]


def commas(rows: Iterable[Iterable[object]]) -> str:
    """Return a table as CSV."""
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerows(rows)
    return written.getvalue()


def escape(text: str) -> str:
    """Return `text` as LaTeX writes it."""
    return text.translate(_WRITTEN)


def tabular(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a tabular of cells in LaTeX, the first column to the left; it needs the package booktabs."""
    top, *lines = (" & ".join(cells) + r" \\" for cells in (heads, *rows))
    begin = rf"\begin{{tabular}}{{l{'r' * (len(heads) - 1)}}}"
    return "\n".join([begin, r"\toprule", top, r"\midrule", *lines, r"\bottomrule", r"\end{tabular}", ""])
