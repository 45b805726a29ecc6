"""The numbers that a law recorded by name."""

from __future__ import annotations

import numpy as np

from flockwire_analysis.figures.drawing import Canvas, Picture, thinned
from flockwire_analysis.figures.legends import legend


def signals(canvas: Canvas) -> Picture | None:
    """Draw the law's own signals, a panel for each name."""
    most = 6  # signals that are drawn
    names = sorted({name for named in canvas.trace.signals.values() for name in named})[:most]
    if not names:
        return None
    figure, panels = canvas.panels(len(names), 1.0 + 1.2 * len(names))
    for axes, name in zip(panels, names, strict=True):
        for number, named in canvas.trace.signals.items():
            if name in named:
                times, values = thinned(canvas.seconds(named[name].stamps), named[name].values)
                sparse = len(times) < 2 or float(np.median(np.diff(times))) > 0.5
                axes.plot(times, values, "o" if sparse else "-", markersize=2.5, color=canvas.colour(number))
        axes.set_ylabel(name)
    figure.align_ylabels(panels)
    legend(panels[0], canvas.names(canvas.trace.signals), rows=canvas.over_time(panels))
    caption = (
        f"Numbers that the law recorded by name, of each follower{f'; the first {most}' if len(names) == most else ''}."
    )
    return Picture(canvas.save(figure, "signals"), "The law's signals", caption)
