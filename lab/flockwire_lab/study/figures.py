"""The figures of a study. Only this file and over.py import matplotlib, which is slow to import."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from flockwire_analysis.figures.drawing import DANGER, INK, OKABE_ITO, STYLE, Picture
from flockwire_core.swarm.model import Swarm
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from flockwire_lab.study.findings import QUANTITIES, Findings, Quantity, label
from flockwire_lab.study.over import over, varied_keys

WIDE = {**STYLE, "font.size": 10.5, "xtick.labelsize": 9.5, "ytick.labelsize": 9.5, "legend.fontsize": 9.5}
MOST_CURVES = len(OKABE_ITO)
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


def _distributions(findings: Findings, swarm: Swarm) -> Figure:
    known = [q for q in QUANTITIES if any(row.figures[q.key] is not None for row in findings.rows)] or [QUANTITIES[0]]
    figure = Figure(figsize=(11.0, 3.2 * -(-len(known) // 2) + 0.4), layout="constrained")
    panels = figure.subplots(-(-len(known) // 2), 2, squeeze=False).ravel()
    for axes, quantity in zip(panels, known, strict=False):
        _distribution(axes, findings, quantity)
        limit = _limit(quantity, swarm)
        if limit is not None:
            axes.axvline(limit, color=DANGER, linewidth=1.1, linestyle=(0, (4, 2)))
    for axes in panels[len(known) :]:
        axes.set_visible(False)
    if len(findings.rows) > 1:
        handles = panels[0].get_lines()[: min(len(findings.rows), MOST_CURVES)]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _distribution(axes: Axes, findings: Findings, quantity: Quantity) -> None:
    """Draw the share of the runs with at most a value, by grid point; runs without a value reduce the total."""
    is_error = quantity.key.endswith("tail_m")
    scale = 1000.0 if is_error else 1.0
    points = findings.plan.points
    shown = [number for number in range(len(points)) if any(r.point == number for r in findings.results)]
    for colour, number in zip(OKABE_ITO, shown, strict=False):
        results = [r.figures.get(quantity.key) for r in findings.results if r.point == number]
        values = scale * np.sort([value for value in results if value is not None])
        shares = 100.0 * np.arange(1, len(values) + 1) / len(results)
        axes.step(values, shares, where="post", color=colour, label=label(dict(points[number])))
    axes.set_xlabel(f"m{quantity.unit}" if is_error else quantity.unit)
    axes.set_ylabel("runs below, %")
    axes.set_ylim(0.0, 101.0)
    if is_error:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    _title(axes, quantity.text[0].upper() + quantity.text[1:])


def _limit(quantity: Quantity, swarm: Swarm) -> float | None:
    return {
        "min_distance_uav_m": swarm.avoidance.drone_safety_distance,
        "min_distance_obstacle_m": swarm.avoidance.obstacle_safety_distance,
        "max_speed_m_s": swarm.limits.speed,
    }.get(quantity.key)


def _title(axes: Axes, text: str) -> None:
    axes.set_title(text, loc="left", fontsize=12, fontweight="bold", color=INK, pad=9)
