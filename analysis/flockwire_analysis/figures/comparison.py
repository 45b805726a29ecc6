"""Overlays flights: errors, distances and paths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from flockwire_analysis import separation, tracking
from flockwire_analysis.figures.drawing import (
    INK,
    MOST_NAMED,
    MUTED,
    NAME_SIZE,
    OKABE_ITO,
    STYLE,
    Canvas,
    legend,
    line,
    thinned,
)
from flockwire_analysis.figures.errors import FLOOR
from flockwire_analysis.phases import airborne
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats
from flockwire_analysis.tracking import Errors, in_formation, places

LOOKS: tuple[tuple[str, Any], ...] = tuple(
    zip(OKABE_ITO, ("-", (0, (3, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), "-", (0, (3, 1.5))), strict=True)
)
MOST = len(LOOKS)  # groups that one figure can show
Look = tuple[str, Any]  # colour, and style of the line
Quantity = Callable[[Trace], tuple[Floats, Floats]]  # to instants (Unix ns) and values


def compare(groups: Sequence[Sequence[Trace]], names: Sequence[str], out: Path) -> tuple[Path, ...]:
    """Overlay the flights of up to MOST groups, each by its own mission time, as comparison and paths in `out`.

    The flights of a group have one colour. Files are PNG and PDF.
    """
    drawn = [(trace, look) for traces, look in zip(groups, LOOKS, strict=False) for trace in traces]
    with rc_context(STYLE):
        return _over_time(drawn, names, out), _from_above(drawn, names, out)


def _over_time(drawn: Sequence[tuple[Trace, Look]], names: Sequence[str], out: Path) -> Path:
    quantities: tuple[tuple[str, Quantity, bool], ...] = (
        ("formation\nerror, m", _formation, True),
        ("observation\nerror, m", lambda trace: _largest(tracking.observation_errors(trace)), True),
        ("smallest\ndistance, m", _nearest, False),
    )
    canvases = [Canvas(trace, out) for trace, _ in drawn]
    figure, panels = canvases[0].panels(len(quantities), 3.9)
    for axes, (label, quantity, logarithmic) in zip(panels, quantities, strict=True):
        for canvas, (_, (colour, style)) in zip(canvases, drawn, strict=True):
            times, values = quantity(canvas.trace)
            seconds = (times - canvas.origin) / 1e9
            axes.plot(*thinned(seconds, values), color=colour, linestyle=style, linewidth=1.0)
        if logarithmic:
            axes.set_yscale("log")
        else:
            axes.set_ylim(bottom=0.0)
            axes.axhline(drawn[0][0].swarm.avoidance.drone_safety_distance, color=MUTED, linewidth=0.7, linestyle=":")
        axes.set_ylabel(label)
    flights = [(canvas.second(canvas.flight.begin), canvas.second(canvas.flight.end)) for canvas in canvases]
    panels[-1].set_xlim(min(begin for begin, _ in flights), max(end for _, end in flights))
    panels[-1].set_xlabel("t, s from the start of the formation")
    figure.align_ylabels(panels)
    legend(panels[0], _entries(names))
    return canvases[0].save(figure, "comparison")


def _from_above(drawn: Sequence[tuple[Trace, Look]], names: Sequence[str], out: Path) -> Path:
    canvas = Canvas(drawn[0][0], out)
    figure, (axes,) = canvas.panels(height=3.5)
    for trace, (colour, style) in drawn:
        times = airborne(trace).instants(1000)
        for number in trace.placed():
            path = places(trace, number, times)[:, :2]
            width = 1.1 if number in trace.swarm.leaders else 0.7
            axes.plot(*path.T, color=colour, linestyle=style, linewidth=width, alpha=0.8)
            if trace is canvas.trace and len(trace.placed()) <= MOST_NAMED:
                _name_end(axes, canvas.name(number), path[np.isfinite(path).all(axis=1)])
        for obstacle in trace.swarm.obstacles:
            axes.plot(*obstacle.center[:2], "x", color=INK, markersize=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x (east), m")
    axes.set_ylabel("y (north), m")
    legend(axes, _entries(names))
    return canvas.save(figure, "paths")


def _name_end(axes: Axes, name: str, path: Floats) -> None:
    for x, y in path[-1:]:
        axes.annotate(name, (x, y), (3, 3), textcoords="offset points", fontsize=NAME_SIZE, color=MUTED, zorder=7)


def _entries(names: Sequence[str]) -> list[Artist]:
    return [line(name, colour, style, 1.3) for name, (colour, style) in zip(names, LOOKS, strict=False)]


def _formation(trace: Trace) -> tuple[Floats, Floats]:
    times, values = _largest(tracking.formation_errors(trace))
    return times, np.where(in_formation(trace, times.astype(np.int64)), values, np.nan)


def _nearest(trace: Trace) -> tuple[Floats, Floats]:
    times = separation.common_times(airborne(trace))
    nearest = [*separation.nearest_drones(trace, times).values()]
    return times.astype(np.float64), np.fmin.reduce(nearest) if nearest else np.full(len(times), np.nan)


def _largest(errors: dict[int, Errors]) -> tuple[Floats, Floats]:
    """Return the largest error of all followers at the stamps of the first that has any."""
    known = [error for error in errors.values() if len(error.stamps)]
    if not known:
        return np.empty(0), np.empty(0)
    times = known[0].stamps.astype(np.float64)
    all_values = [np.interp(times, error.stamps, error.values) for error in known]
    return times, np.maximum(np.max(all_values, axis=0), FLOOR)
