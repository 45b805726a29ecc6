"""Distances between drones and to obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from flockwire_analysis import separation
from flockwire_analysis.figures.drawing import DANGER, OKABE_ITO, Canvas, Picture, thinned
from flockwire_analysis.figures.legends import MARK, dot, legend, line
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats, Integers

GREY = "#9aa3b2"
MANY = 30  # drones, of which no picture shows every pair


def between_drones(canvas: Canvas) -> Picture | None:
    """Draw the distance of every pair, or of many drones that to the nearest other one, and the smallest of all."""
    trace, times = canvas.trace, separation.common_times(canvas.flight)
    many = len(trace.flying) > MANY
    known = {drones: d for drones, d in _found(trace, times, many) if np.isfinite(d).any()}
    if not known:
        return None
    figure, (axes,) = canvas.panels()
    seconds = canvas.seconds(times)
    for distances in known.values():
        axes.plot(*thinned(seconds, distances), color=GREY, linewidth=0.6, alpha=max(0.12, 0.7 - 0.02 * len(known)))
    nearest = np.fmin.reduce(list(known.values()))
    axes.plot(*thinned(seconds, nearest), color=OKABE_ITO[0], linewidth=1.3)
    (one, *rest), at = _lowest(axes, seconds, known)
    (other,) = rest or (separation.nearest_to(trace, one, int(times[at])),)
    limit = trace.swarm.avoidance.drone_safety_distance
    _limit(axes, limit)
    axes.set_ylim(0.0, 1.05 * max(float(np.nanmax(d)) for d in known.values()))
    axes.set_ylabel("distance, m")
    rows = canvas.over_time([axes])
    lowest = f"{nearest[at]:.2f} m: {canvas.name(one)}, {canvas.name(other)}, {seconds[at]:.1f} s"
    grey = "a drone to the nearest" if many else "a pair"
    legend(axes, [line(grey, GREY), line("smallest", OKABE_ITO[0]), _named(limit)], [dot(lowest)], rows)
    whose = "From every drone to the nearest other one" if many else "Every pair"
    caption = f"{whose} in grey, the smallest of all in blue; the marked one is the smallest of the flight."
    return Picture(canvas.save(figure, "distances"), "Distances between drones", caption)


def _found(trace: Trace, times: Integers, many: bool) -> Iterator[tuple[tuple[int, ...], Floats]]:
    """Yield the distances of every pair, or of `many` drones that of each to the nearest other one."""
    if many:
        yield from (((number,), d) for number, d in separation.nearest_drones(trace, times).items())
    else:
        yield from (((i, j), d) for i, j, d in separation.pair_distances(trace, times))


def to_obstacles(canvas: Canvas) -> Picture | None:
    """Draw the distance of every drone to the nearest obstacle."""
    if not canvas.trace.swarm.obstacles:
        return None
    times = separation.common_times(canvas.flight)
    found = separation.obstacle_distances(canvas.trace, times)
    known = {number: d for number, d in found.items() if np.isfinite(d).any()}
    if not known:
        return None
    figure, (axes,) = canvas.panels()
    seconds = canvas.seconds(times)
    for number, distances in known.items():
        axes.plot(*thinned(seconds, distances), color=canvas.colour(number))
    number, at = _lowest(axes, seconds, known)
    limit = canvas.trace.swarm.avoidance.obstacle_safety_distance
    _limit(axes, limit)
    lowest = float(known[number][at])
    axes.set_ylim(min(0.0, 1.1 * lowest), 1.05 * max(float(np.nanmax(d)) for d in known.values()))
    axes.set_ylabel("distance to the surface, m")
    rows = canvas.over_time([axes])
    named = f"{lowest:.2f} m: {canvas.name(number)}, {seconds[at]:.1f} s"
    legend(axes, canvas.names(known), [_named(limit), dot(named)], rows)
    caption = "From each drone to the nearest obstacle's surface; the marked one is the smallest of the flight."
    return Picture(canvas.save(figure, "obstacle_distances"), "Distances to obstacles", caption)


def _lowest(axes: Axes, seconds: Floats, known: Mapping[Any, Floats]) -> tuple[Any, int]:
    """Mark the smallest of all values; return its series and index."""
    whose = min(known, key=lambda one: float(np.nanmin(known[one])))
    at = int(np.nanargmin(known[whose]))
    axes.plot([seconds[at]], [known[whose][at]], linestyle="", **MARK)
    return whose, at


def _limit(axes: Axes, value: float) -> None:
    axes.axhspan(-1e3, value, color=DANGER, alpha=0.06, linewidth=0, zorder=0)
    axes.axhline(value, color=DANGER, linewidth=0.9, zorder=1.5)


def _named(limit: float) -> Any:  # noqa: ANN401  (an artist)
    return line(f"to be kept, {limit:g} m", DANGER)
