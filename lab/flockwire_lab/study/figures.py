"""The figures of a study. They import matplotlib, which is slow to import, as law_table.py does."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from flockwire_analysis.figures.drawing import DANGER, INK, OKABE_ITO, STYLE, Picture
from flockwire_core.swarm.model import Swarm
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from pydantic import JsonValue

from flockwire_lab.study.findings import Findings, GridPointFigures, label
from flockwire_lab.study.flight import QUANTITIES, Quantity

WIDE = {**STYLE, "font.size": 10.5, "xtick.labelsize": 9.5, "ytick.labelsize": 9.5, "legend.fontsize": 9.5}
FEWEST = 3  # values of a parameter that make a curve
SUCCESS = "The share of the flights that passed all checks, with its 95 % interval (Wilson)."
DISTRIBUTIONS = "The share of the flights with at most a value; a dashed line is a bound of the swarm file."
OVER = "The median of the flights, and a band up to the bound that 95 % of them keep."


def draw(findings: Findings, swarm: Swarm, out: Path, pdf: bool = False) -> tuple[Picture, ...]:
    """Draw success rates, distributions and curves over varied parameters into `out`, as PNG and perhaps as PDF too."""
    with rc_context(WIDE):
        drawn = [
            (_success(findings), Picture(out / "success.png", "Success rate", SUCCESS)),
            (_distributions(findings, swarm), Picture(out / "distributions.png", "Distributions", DISTRIBUTIONS)),
            *(
                (over(findings, key), Picture(out / f"over_{key}.png", f"Over {key}", OVER))
                for key in varied_keys(findings)
            ),
        ]
        for figure, picture in drawn:
            figure.savefig(picture.path, dpi=150, facecolor="white")
            if pdf:
                figure.savefig(picture.path.with_suffix(".pdf"), metadata={"CreationDate": None})
    return tuple(picture for _, picture in drawn)


def _success(findings: Findings) -> Figure:
    figure = Figure(figsize=(9.0, 1.3 + 0.38 * len(findings.rows)), layout="constrained")
    axes = figure.add_subplot()
    for place, row in enumerate(findings.rows):
        axes.plot([100.0 * row.low, 100.0 * row.high], [place, place], color=OKABE_ITO[0], linewidth=3, alpha=0.45)
        axes.plot([100.0 * row.rate], [place], "o", color=OKABE_ITO[0])
    axes.set_yticks(range(len(findings.rows)), [label(row.point) for row in findings.rows])
    axes.set_ylim(len(findings.rows) - 0.5, -0.5)
    axes.set_xlabel("runs that pass all checks, %, with the 95 % interval")
    _title(axes, "Success rate")
    return figure


def _panels(findings: Findings, draw_in: Callable[[Axes, Quantity], None]) -> Figure:
    """Return a figure with a panel for each figure that a run has, drawn by `draw_in`, and one legend."""
    known = [q for q in QUANTITIES if any(row.figures[q.key] is not None for row in findings.rows)] or [QUANTITIES[0]]
    figure = Figure(figsize=(11.0, 3.2 * -(-len(known) // 2) + 0.4), layout="constrained")
    panels = figure.subplots(-(-len(known) // 2), 2, squeeze=False).ravel()
    for axes, quantity in zip(panels, known, strict=False):
        draw_in(axes, quantity)
        _title(axes, quantity.text[0].upper() + quantity.text[1:])
    for axes in panels[len(known) :]:
        axes.set_visible(False)
    handles = [line for line in panels[0].get_lines() if not str(line.get_label()).startswith("_")]
    if len(handles) > 1:
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _scale(quantity: Quantity) -> tuple[float, str]:
    """Return the factor and the unit in which a figure is drawn: errors in mm."""
    return (1000.0, "mm") if quantity.key.endswith("tail_m") else (1.0, quantity.unit)


def _distributions(findings: Findings, swarm: Swarm) -> Figure:
    """Draw the share of the runs with at most a value, by grid point; runs without a value reduce the total."""
    points = findings.plan.points
    flown = [number for number in range(len(points)) if any(r.point == number for r in findings.results)]

    def draw_in(axes: Axes, quantity: Quantity) -> None:
        scale, unit = _scale(quantity)
        for colour, number in zip(OKABE_ITO, flown, strict=False):
            results = [r.figures.get(quantity.key) for r in findings.results if r.point == number]
            values = scale * np.sort([value for value in results if value is not None])
            shares = 100.0 * np.arange(1, len(values) + 1) / len(results)
            axes.step(values, shares, where="post", color=colour, label=label(dict(points[number])))
        axes.set_xlabel(unit)
        axes.set_ylabel("runs below, %")
        axes.set_ylim(0.0, 101.0)
        if unit == "mm":
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
        if (bound := quantity.limit(swarm)) is not None:
            axes.axvline(bound, color=DANGER, linewidth=1.1, linestyle=(0, (4, 2)))

    return _panels(findings, draw_in)


def varied_keys(findings: Findings) -> list[str]:
    """Return the keys of the grid with FEWEST numbers or more as values."""
    values: dict[str, set[JsonValue]] = {}
    for row in findings.rows:
        for key, value in row.point.items():
            values.setdefault(key, set()).add(value if type(value) in (int, float) else None)
    return [key for key, found in values.items() if len(found) >= FEWEST and None not in found]


def over(findings: Findings, key: str) -> Figure:
    """Draw each figure over the values of `key`, a curve for each combination of the grid's other keys.

    It is the median of the runs, and a band up to the bound that 95 % keep.
    """
    curves: dict[str, list[tuple[Any, GridPointFigures]]] = {}
    for row in sorted(findings.rows, key=lambda row: row.point[key]):  # type: ignore[arg-type,return-value]
        others = {name: value for name, value in row.point.items() if name != key}
        curves.setdefault(label(others), []).append((row.point[key], row))

    def draw_in(axes: Axes, quantity: Quantity) -> None:
        scale, unit = _scale(quantity)
        for (name, curve), colour in zip(curves.items(), OKABE_ITO, strict=False):
            found = [row.figures[quantity.key] for _, row in curve]
            middle, bound = (
                [nan if q is None or (value := getattr(q, part)) is None else scale * value for q in found]
                for part in ("p50", "p95")
            )
            xs = [x for x, _ in curve]
            axes.plot(xs, middle, "o-", color=colour, markersize=4, label=name)
            axes.fill_between(xs, middle, bound, color=colour, alpha=0.2, linewidth=0)
        axes.ticklabel_format(useOffset=False)
        axes.set_xlabel(key)
        axes.set_ylabel(unit)

    return _panels(findings, draw_in)


def _title(axes: Axes, text: str) -> None:
    axes.set_title(text, loc="left", fontsize=12, fontweight="bold", color=INK, pad=9)
