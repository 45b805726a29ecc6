"""A table for a paper, in LaTeX."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

_WRITTEN = str.maketrans(
    {sign: f"\\{sign}" for sign in "_%&#${}"}
    | {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    | {"²": "$^2$", "\N{EN DASH}": "--"}
)


def escape(text: str) -> str:
    """Return `text` as LaTeX writes it."""
    return text.translate(_WRITTEN)


def tabular(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a tabular of cells in LaTeX, the first column to the left; it needs the package booktabs."""
    top, *lines = (" & ".join(cells) + r" \\" for cells in (heads, *rows))
    begin = rf"\begin{{tabular}}{{l{'r' * (len(heads) - 1)}}}"
    return "\n".join([begin, r"\toprule", top, r"\midrule", *lines, r"\bottomrule", r"\end{tabular}", ""])
