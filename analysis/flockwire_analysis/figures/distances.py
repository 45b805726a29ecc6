"""Distances between drones and to obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from flockwire_analysis import separation
from flockwire_analysis.figures.drawing import DANGER, INK, OKABE_ITO, Canvas, Picture, legend, line, thinned
from flockwire_analysis.series import Floats, Integers

GREY = "#9aa3b2"
MARK: dict[str, Any] = {
    "marker": "o", "markersize": 3.6, "markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 0.9,
    "zorder": 6,
}  # fmt: skip
MANY = 30  # drones, of which no picture shows every pair


def between_drones(canvas: Canvas) -> Picture | None:
    """Draw the distance of every pair, or of many drones that to the nearest other one, and the smallest of all."""
    trace, times = canvas.trace, separation.common_times(canvas.flight)
    found: dict[tuple[int, ...], Floats]
    if len(trace.flying) > MANY:
        found = {(number,): d for number, d in separation.nearest_drones(trace, times).items()}
        whose, grey = "From every drone to the nearest other one", "a drone to the nearest"
    else:
        found = {(i, j): d for i, j, d in separation.pair_distances(trace, times)}
        whose, grey = "Every pair", "a pair"
    caption = f"{whose} in grey, the smallest of all in blue; the marked one is the smallest of the flight."
    limit = trace.swarm.avoidance.drone_safety_distance
    return _draw(canvas, found, limit, "distance, m", "distances", "Distances between drones", caption, grey)


def to_obstacles(canvas: Canvas) -> Picture | None:
    """Draw the distance of every drone to the nearest obstacle."""
    trace, times = canvas.trace, separation.common_times(canvas.flight)
    if not trace.swarm.obstacles:
        return None
    found: dict[tuple[int, ...], Floats] = {(i,): d for i, d in separation.obstacle_distances(trace, times).items()}
    caption = "From each drone to the nearest obstacle's surface; the marked one is the smallest of the flight."
    limit, axis = trace.swarm.avoidance.obstacle_safety_distance, "distance to the surface, m"
    return _draw(canvas, found, limit, axis, "obstacle_distances", "Distances to obstacles", caption)


def _draw(
    canvas: Canvas, found: dict[tuple[int, ...], Floats], limit: float, axis: str, name: str, title: str,
    caption: str, grey: str = "",
) -> Picture | None:  # fmt: skip
    """Draw distances and their limit, each drone's in its colour, or all in `grey` (its name) and the smallest."""
    known = {drones: d for drones, d in found.items() if np.isfinite(d).any()}
    if not known:
        return None
    times = separation.common_times(canvas.flight)
    seconds = canvas.seconds(times)
    pale: dict[str, Any] = {"linewidth": 0.6, "alpha": max(0.12, 0.7 - 0.02 * len(known))} if grey else {}
    figure, (axes,) = canvas.panels()
    for drones, distances in known.items():
        axes.plot(*thinned(seconds, distances), color=GREY if grey else canvas.colour(drones[0]), **pale)
    if grey:
        axes.plot(*thinned(seconds, np.fmin.reduce(list(known.values()))), color=OKABE_ITO[0], linewidth=1.3)
    marked = _mark_smallest(canvas, axes, known, times, bool(grey))
    axes.axhspan(-1e3, limit, color=DANGER, alpha=0.06, linewidth=0, zorder=0)
    kept = line(f"to be kept, {limit:g} m", DANGER)
    axes.axhline(limit, color=DANGER, linewidth=0.9, zorder=1.5)
    axes.set_ylabel(axis)
    if grey:
        entries, others = [line(grey, GREY), line("smallest", OKABE_ITO[0]), kept], [marked]
    else:
        entries, others = canvas.names(drones[0] for drones in known), [kept, marked]
    legend(axes, entries, others, canvas.over_time([axes]))
    return Picture(canvas.save(figure, name), title, caption)


def _mark_smallest(
    canvas: Canvas, axes: Axes, known: dict[tuple[int, ...], Floats], times: Integers, in_pairs: bool
) -> Artist:
    """Mark the smallest of all values, on axes that show the largest, too; return its entry of a legend."""
    whose = min(known, key=lambda drones: float(np.nanmin(known[drones])))
    at = int(np.nanargmin(known[whose]))
    lowest, when = float(known[whose][at]), canvas.second(int(times[at]))
    axes.set_ylim(min(0.0, 1.1 * lowest), 1.05 * max(float(np.nanmax(d)) for d in known.values()))
    if in_pairs and len(whose) == 1:
        whose = (*whose, separation.nearest_to(canvas.trace, *whose, int(times[at])))
    text = f"{lowest:.2f} m: {', '.join(map(canvas.name, whose))}, {when:.1f} s"
    (mark,) = axes.plot([when], [lowest], linestyle="", label=text, **MARK)
    return mark
