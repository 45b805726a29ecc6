"""The flight from above."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from flockwire.control.graph import LEADER
from flockwire.nanoseconds import BILLION
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, Polygon

from flockwire_recorder.drawing import DANGER, INK, MOST_POINTS, MUTED, Canvas, title
from flockwire_recorder.phases import Span
from flockwire_recorder.reading import Floats, Integers
from flockwire_recorder.tracking import formation_errors, interpolated, settling_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SNAPSHOTS = 3
SMALLEST_DISC = 0.04  # m: a point obstacle is drawn this large


def draw_trajectories(canvas: Canvas) -> Path:
    """Draw trajectories.png: XY paths, obstacles with their safety ring, starts, ends and the formation at instants."""
    figure, axes = canvas.panel(8.6, 8.6)
    shown = Span(canvas.flight.begin, canvas.phase.end if canvas.phase is not None else canvas.flight.end)
    times = np.linspace(shown.begin, shown.end, MOST_POINTS // 2).astype(np.int64)
    paths = {number: interpolated(canvas.trace.positions(number), times)[:, :2] for number in canvas.trace.placed()}
    _obstacles(axes, canvas)
    _snapshots(axes, canvas)
    for number, path in reversed(paths.items()):
        _path(axes, path, canvas.colour(number), 2.2 if number == LEADER else 1.7)
    for number, path in paths.items():
        _ends(axes, path[np.isfinite(path).all(axis=1)], canvas.colour(number))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.set_xlabel("x (east), m")
    axes.set_ylabel("y (north), m")
    canvas.legend(axes, paths)
    title(axes, canvas.trace.swarm.name.replace("_", " "))
    return canvas.save(figure, "trajectories.png", dpi=170)


def _path(axes: Axes, path: Floats, colour: str, width: float) -> None:
    """Draw a path that is paler where it is longer ago."""
    segments = np.stack([path[:-1], path[1:]], axis=1)
    fade = np.linspace(0.0, 1.0, len(segments))
    colours = np.tile(to_rgba(colour), (len(segments), 1))
    colours[:, 3] = 0.16 + 0.84 * fade**1.6
    lines = LineCollection(list(segments), colors=colours, linewidths=width, capstyle="butt", zorder=3)
    axes.add_collection(lines)


def _ends(axes: Axes, path: Floats, colour: str) -> None:
    if not len(path):
        return
    for place, face, edge in ((path[0], "white", colour), (path[-1], colour, "white")):
        axes.plot(
            *place, "o", markersize=9, markerfacecolor=face, markeredgecolor=edge, markeredgewidth=1.6, zorder=6,
            clip_on=False,
        )  # fmt: skip


def _obstacles(axes: Axes, canvas: Canvas) -> None:
    safe = canvas.trace.swarm.avoidance.obstacle_safety_distance
    for obstacle in canvas.trace.swarm.obstacles:
        center = obstacle.center[:2]
        ring = Circle(center, obstacle.radius + safe, facecolor=DANGER, alpha=0.07, linewidth=0, zorder=1)
        edge = Circle(
            center, obstacle.radius + safe, fill=False, edgecolor=DANGER, linewidth=1.1, linestyle=(0, (4, 3)), zorder=2
        )
        disc = Circle(center, max(obstacle.radius, SMALLEST_DISC), facecolor="#4a505c", linewidth=0, zorder=2)
        for patch in (ring, edge, disc):
            axes.add_patch(patch)


def _snapshots(axes: Axes, canvas: Canvas) -> None:
    """Link the followers at a few instants of the formation phase, once they have settled."""
    if canvas.phase is None or LEADER not in canvas.trace.placed():
        return
    for stamp in _instants(canvas, canvas.phase):
        at = np.array([stamp])
        places = [interpolated(canvas.trace.positions(i), at)[0, :2] for i in canvas.trace.swarm.followers]
        known = np.array([place for place in places if np.isfinite(place).all()])
        if len(known) < 2:
            continue
        center = known.mean(axis=0)
        turn = np.argsort(np.arctan2(*(known - center).T[::-1]))
        axes.add_patch(Polygon(known[turn], facecolor="#8d97a8", edgecolor=MUTED, alpha=0.16, linewidth=0, zorder=1.2))
        axes.add_patch(Polygon(known[turn], fill=False, edgecolor=MUTED, alpha=0.8, linewidth=0.9, zorder=1.3))
        leader = interpolated(canvas.trace.positions(LEADER), at)[0, :2]
        axes.plot(*known.T, "o", markersize=4.5, color=MUTED, zorder=4, markeredgecolor="white", markeredgewidth=0.8)
        axes.plot(*leader, "o", markersize=5.5, color=INK, zorder=5, markeredgecolor="white", markeredgewidth=0.8)


def _instants(canvas: Canvas, phase: Span) -> Integers:
    """Return instants from when the formation has settled until the last at which everybody's place is known."""
    settled = settling_time(formation_errors(canvas.trace), phase) or 0.0
    ends = [series.stamps[-1] for series in map(canvas.trace.positions, canvas.trace.placed())]
    begin = phase.begin + int(settled * BILLION)
    return np.linspace(begin, max(begin, min(phase.end, *ends)), SNAPSHOTS).astype(np.int64)
