"""The flight from above."""

from __future__ import annotations

import numpy as np
from flockwire_core.domain.time import SECOND
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, Polygon

from flockwire_analysis.figures.drawing import COLUMN, DANGER, INK, MOST_POINTS, MUTED, Canvas, Picture, legend, line
from flockwire_analysis.phases import Span
from flockwire_analysis.series import Floats, Integers
from flockwire_analysis.tracking import interpolated, settling_time

FENCE = (0, (6, 2, 1, 2))
RING, DASHED = "#69707d", (0, (4, 3))  # round an obstacle
SMALLEST_DISC = 0.04  # m, drawn radius of a point obstacle


def trajectories(canvas: Canvas) -> Picture | None:
    """Draw XY paths, fence, obstacles with their safety ring, starts, ends and the formation at instants."""
    if not canvas.trace.placed():
        return None
    figure, (axes,) = canvas.panels(height=COLUMN)
    shown = Span(canvas.flight.begin, canvas.phases[-1].span.end if canvas.phases else canvas.flight.end)
    times = shown.instants(MOST_POINTS)
    paths = {number: interpolated(canvas.trace.positions(number), times)[:, :2] for number in canvas.trace.placed()}
    obstacles(axes, canvas)
    _snapshots(axes, canvas)
    for number, path in reversed(paths.items()):
        _path(axes, path, canvas.colour(number), 1.3 if number in canvas.trace.swarm.leaders else 1.0)
    for number, path in paths.items():
        _ends(axes, path[np.isfinite(path).all(axis=1)], canvas.colour(number))
    axes.set_aspect("equal", adjustable="box")
    fenced = view(axes, canvas, np.concatenate([path[np.isfinite(path).all(axis=1)] for path in paths.values()]))
    axes.set_xlabel("x (east), m")
    axes.set_ylabel("y (north), m")
    others = [line(_fence_name(canvas), DANGER, FENCE)] if fenced else []
    caption = ""
    if canvas.trace.swarm.obstacles:
        others.append(line("clearance of obstacles", RING, DASHED))
        caption = " Filled discs are obstacles, the dashed ring is the required clearance."
    legend(axes, canvas.names(paths), others)
    text = (
        "The flight from above; older parts are paler. Open markers: starts; filled: ends. "
        "Grey lines connect the followers at a few times. The fence is drawn if it is in view."
    )
    return Picture(canvas.save(figure, "trajectories"), "Trajectories", text + caption)


def _fence_name(canvas: Canvas) -> str:
    fence = canvas.trace.swarm.limits.fence
    if fence.polygon:
        return f"fence, polygon of {len(fence.polygon)} corners"
    spans = (f"{axis} {fence.low[k]:g} … {fence.high[k]:g}" for k, axis in enumerate("xy"))
    return f"fence, {', '.join(spans)} m"


def view(axes: Axes, canvas: Canvas, places: Floats) -> bool:
    """Show the paths, with the fence unless they would be small; return whether it is in view."""
    fence_in_view = 1.8  # times the extent of the paths: a larger fence would make them small
    fence = canvas.trace.swarm.limits.fence
    width, depth = (fence.high[axis] - fence.low[axis] for axis in (0, 1))
    (left, lower, _), (right, upper, _) = fence.low, fence.high
    corners = fence.polygon or ((left, lower), (right, lower), (right, upper), (left, upper))
    axes.add_patch(Polygon(corners, fill=False, edgecolor=DANGER, linewidth=0.9, linestyle=FENCE, zorder=2))
    low, high = places.min(axis=0), places.max(axis=0)
    middle, half = (low + high) / 2.0, 0.55 * max(float((high - low).max()), 1.0)
    whole = max(width, depth) <= fence_in_view * 2.0 * half
    if whole:
        low, high = np.minimum(low, fence.low[:2]), np.maximum(high, fence.high[:2])
        middle, half = (low + high) / 2.0, 0.52 * float((high - low).max())
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    inside = (middle - half > fence.low[:2]).all() and (middle + half < fence.high[:2]).all()
    return whole or bool(fence.polygon) or not inside


def _path(axes: Axes, path: Floats, colour: str, width: float) -> None:
    """Draw a path whose older parts are paler."""
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
            *place, "o", markersize=5, markerfacecolor=face, markeredgecolor=edge, markeredgewidth=0.9, zorder=6,
            clip_on=False,
        )  # fmt: skip


def obstacles(axes: Axes, canvas: Canvas) -> None:
    """Draw the obstacles and their required clearance."""
    safe = canvas.trace.swarm.avoidance.obstacle_safety_distance
    for obstacle in canvas.trace.swarm.obstacles:
        center = obstacle.center[:2]
        ring = Circle(center, obstacle.radius + safe, facecolor=RING, alpha=0.1, linewidth=0, zorder=1)
        edge = Circle(
            center, obstacle.radius + safe, fill=False, edgecolor=RING, linewidth=0.7, linestyle=DASHED, zorder=2
        )
        disc = Circle(center, max(obstacle.radius, SMALLEST_DISC), facecolor="#4a505c", linewidth=0, zorder=2)
        for patch in (ring, edge, disc):
            axes.add_patch(patch)


def _snapshots(axes: Axes, canvas: Canvas) -> None:
    """Connect the followers at a few instants of the longest formation phase, after they have settled."""
    sole = canvas.trace.swarm.sole_leader
    if not canvas.phases or sole is None or sole not in canvas.trace.placed():
        return
    longest = max((phase.span for phase in canvas.phases), key=lambda span: span.length)
    for stamp in _instants(canvas, longest):
        at = np.array([stamp])
        places = [interpolated(canvas.trace.positions(i), at)[0, :2] for i in canvas.trace.followers]
        known = np.array([place for place in places if np.isfinite(place).all()])
        if len(known) < 2:
            continue
        center = known.mean(axis=0)
        turn = np.argsort(np.arctan2(*(known - center).T[::-1]))
        axes.add_patch(Polygon(known[turn], facecolor="#8d97a8", edgecolor=MUTED, alpha=0.16, linewidth=0, zorder=1.2))
        axes.add_patch(Polygon(known[turn], fill=False, edgecolor=MUTED, alpha=0.8, linewidth=0.6, zorder=1.3))
        leader = interpolated(canvas.trace.positions(sole), at)[0, :2]
        axes.plot(*known.T, "o", markersize=2.6, color=MUTED, zorder=4, markeredgecolor="white", markeredgewidth=0.5)
        axes.plot(*leader, "o", markersize=3.2, color=INK, zorder=5, markeredgecolor="white", markeredgewidth=0.5)


def _instants(canvas: Canvas, phase: Span) -> Integers:
    """Return instants from settling to the last one at which all positions are known."""
    snapshots = 3
    settled = settling_time(canvas.formation_errors, phase) or 0.0
    ends = [series.stamps[-1] for series in map(canvas.trace.positions, canvas.trace.placed())]
    begin = phase.begin + int(settled * SECOND)
    return Span(begin, max(begin, min(phase.end, *ends))).instants(snapshots)
