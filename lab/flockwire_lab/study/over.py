"""The figures of a study over a parameter that its grid varies: one curve for each combination of the other keys."""

from __future__ import annotations

from math import nan

import numpy as np
from flockwire_analysis.figures.drawing import OKABE_ITO
from matplotlib.figure import Figure

from flockwire_lab.study.findings import QUANTITIES, Findings, GridPointFigures, label

FEWEST = 3  # values of a parameter that make a curve
Curves = dict[str, list[tuple[float, GridPointFigures]]]  # by the other keys of the grid


def varied_keys(findings: Findings) -> list[str]:
    """Return the keys of the grid with FEWEST numbers or more as values."""
    values: dict[str, set[float]] = {}
    for row in findings.rows:
        for key, value in row.point.items():
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            values.setdefault(key, set()).add(float(value) if is_number else nan)  # type: ignore[arg-type]
    return [key for key, found in values.items() if len(found) >= FEWEST and not any(np.isnan(list(found)))]


def over(findings: Findings, key: str) -> Figure:
    """Draw each figure over the values of `key`: the median of the runs, and a band up to the bound that 95 % keep."""
    known = [one for one in QUANTITIES if any(row.figures[one.key] is not None for row in findings.rows)]
    figure = Figure(figsize=(11.0, 3.2 * -(-len(known) // 2) + 0.4), layout="constrained")
    panels = figure.subplots(-(-len(known) // 2), 2, squeeze=False).ravel()
    curves = _curves(findings, key)
    for axes, one in zip(panels, known, strict=False):
        scale, unit = (1000.0, "mm") if one.key.endswith("tail_m") else (1.0, one.unit)
        for (name, curve), colour in zip(curves.items(), OKABE_ITO, strict=False):
            found = [(x, row.figures[one.key]) for x, row in curve]
            xs = [x for x, _ in found]
            middle, bound = (
                [nan if q is None or (value := getattr(q, part)) is None else scale * value for _, q in found]
                for part in ("p50", "p95")
            )
            axes.plot(xs, middle, "o-", color=colour, markersize=4, label=name)
            axes.fill_between(xs, middle, bound, color=colour, alpha=0.2, linewidth=0)
        axes.ticklabel_format(useOffset=False)
        axes.set_xlabel(key)
        axes.set_ylabel(unit)
        axes.set_title(one.text[0].upper() + one.text[1:], loc="left", fontsize=12, fontweight="bold", pad=9)
    for axes in panels[len(known) :]:
        axes.set_visible(False)
    if len(curves) > 1:
        figure.legend(handles=panels[0].get_lines(), loc="outside lower center", ncols=2)
    return figure


def _curves(findings: Findings, key: str) -> Curves:
    """Return the rows of each curve, by the value of `key`."""
    curves: Curves = {}
    for row in findings.rows:
        others = {name: value for name, value in row.point.items() if name != key}
        curves.setdefault(label(others), []).append((float(row.point[key]), row))  # type: ignore[arg-type]
    return {name: sorted(curve, key=lambda one: one[0]) for name, curve in curves.items()}
