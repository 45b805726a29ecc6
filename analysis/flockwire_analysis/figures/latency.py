"""The latency of each hop."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from flockwire_analysis.figures.drawing import INK, OKABE_ITO, Canvas, Picture
from flockwire_analysis.latency import HOPS, latencies, percentiles
from flockwire_analysis.series import Floats


def latency(canvas: Canvas) -> Picture | None:
    """Draw the distribution of each hop's delay."""
    hops = {hop: latencies(canvas.trace, hop) for hop in HOPS}
    known = {hop: delays[delays > 0.0] for hop, delays in hops.items() if (delays > 0.0).any()}
    if not known:
        return None
    figure, (axes,) = canvas.panels(height=0.6 + 0.55 * len(known))
    shortest = min(float(delays.min()) for delays in known.values())
    longest = max(float(delays.max()) for delays in known.values())
    bins = np.geomspace(0.8 * shortest, 1.25 * longest, 140)
    for row, (delays, colour) in enumerate(zip(known.values(), OKABE_ITO, strict=False)):
        _ridge(axes, -row, delays, bins, colour)
    _logarithmic(axes, shortest, longest)
    axes.set_xlim(bins[0], bins[-1])
    axes.set_yticks([-row for row in range(len(known))], [hop.replace("_to_", " → ") for hop in known])
    axes.tick_params(axis="y", labelcolor=INK)
    axes.set_ylim(0.75 - len(known), 1.0)
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("delay, ms")
    caption = "Distribution of the time from one message to its answer, all drones; ticks at the median and at 99 %."
    return Picture(canvas.save(figure, "latency"), "Latency", caption)


def _logarithmic(axes: Axes, shortest: float, longest: float) -> None:
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if longest < 30 * shortest else (1.0,)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())


def _ridge(axes: Axes, base: float, delays: Floats, bins: Floats, colour: str) -> None:
    """Draw one hop's distribution above `base`, with its median and its 99th percentile."""
    counts, _ = np.histogram(delays, bins)
    heights = base + 0.5 * counts / counts.max()
    axes.fill_between(bins[:-1], base, heights, step="post", color=colour, alpha=0.75, linewidth=0)
    marks = percentiles(delays)
    for value, name, side in ((marks.p50, "p50", "right"), (marks.p99, "p99", "left")):
        if value is not None:
            axes.plot([value, value], [base - 0.06, base + 0.56], color=INK, linewidth=0.7)
            axes.annotate(
                f"{name} {value:.3g}", (value, base + 0.56), (-2 if side == "right" else 2, 0.5), va="bottom", ha=side,
                textcoords="offset points", fontsize=6.5, color=INK,
            )  # fmt: skip
