"""The paper's figures, drawn from a trace. Only this file and drawing.py know matplotlib, which is slow to import."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, NullLocator

from flockwire_recorder import separation, tracking
from flockwire_recorder.drawing import DANGER, INK, MUTED, OKABE_ITO, STYLE, Canvas, envelope, thinned, title
from flockwire_recorder.latency import HOPS, latencies, percentiles
from flockwire_recorder.reading import Floats, Trace
from flockwire_recorder.tracking import SETTLED_BELOW, Errors
from flockwire_recorder.trajectories import draw_trajectories

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FLOOR = 1e-4  # m: errors are drawn down to this
_HALO = withStroke(linewidth=3, foreground="white")


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure on disk and what it shows."""

    path: Path
    title: str
    caption: str


def draw(trace: Trace, out: Path) -> tuple[Picture, ...]:
    """Draw every figure that the trace has something for into the folder `out`, as PNG."""
    canvas = Canvas(trace, out)
    drawn: list[Picture] = []
    with rc_context(STYLE):
        for figure in _FIGURES:
            picture = figure(canvas)
            if picture is not None:
                drawn.append(picture)
    return tuple(drawn)


def _trajectories(canvas: Canvas) -> Picture | None:
    if not canvas.trace.placed():
        return None
    caption = (
        "The flight from above, paler where it is longer ago. Open markers: starts; filled: ends; the leader is black. "
        "Grey shapes link the followers at a few instants."
    )
    if canvas.trace.swarm.obstacles:
        caption += " Dark discs are obstacles, the dashed ring is the clearance that must be kept."
    return Picture(draw_trajectories(canvas), "Trajectories", caption)


def _observation(canvas: Canvas) -> Picture | None:
    errors = tracking.observation_errors(canvas.trace)
    caption = "How far each follower's estimate of the leader's position is from where the leader was."
    return _errors(canvas, errors, "Observation error", r"$|\eta_i - x_0|$, m", caption)


def _formation(canvas: Canvas) -> Picture | None:
    if canvas.phase is None:
        return None
    errors = tracking.formation_errors(canvas.trace)
    caption = "How far each follower is from its place in the formation round the leader."
    return _errors(canvas, errors, "Formation error", r"$|x_i - h_i - x_0|$, m", caption)


def _errors(canvas: Canvas, errors: dict[int, Errors], name: str, label: str, caption: str) -> Picture | None:
    known = {number: error for number, error in errors.items() if len(error.stamps)}
    if not known:
        return None
    figure, axes = canvas.panel()
    for number, error in known.items():
        times, values = envelope(canvas.seconds(error.stamps), np.maximum(error.values, FLOOR))
        axes.plot(times, values, color=canvas.colour(number), linewidth=1.3, alpha=0.9)
    top = max(float(error.values.max()) for error in known.values())
    axes.set_yscale("log")
    axes.set_ylim(FLOOR, max(2.5 * top, 4 * SETTLED_BELOW))
    axes.set_ylabel(label)
    axes.axhline(SETTLED_BELOW, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
    _beside(axes, SETTLED_BELOW, "settled", MUTED)
    spans = [canvas.seconds(error.stamps[[0, -1]]) for error in known.values()]
    canvas.mark_phases(axes, min(float(span[0]) for span in spans), max(float(span[1]) for span in spans))
    canvas.legend(axes, known)
    title(axes, name)
    caption += (
        " The largest of every tenth of a second or so, logarithmic; the shaded tail is what the flight is judged by."
    )
    return Picture(canvas.save(figure, f"{name.lower().replace(' ', '_')}.png"), name, caption)


def _distances(canvas: Canvas) -> Picture | None:
    times = separation.common_times(canvas.flight)
    pairs = [d for d in separation.pair_distances(canvas.trace, times).values() if np.isfinite(d).any()]
    limit = canvas.trace.swarm.avoidance.drone_safety_distance
    if not pairs:
        return None
    figure, axes = canvas.panel()
    seconds = canvas.seconds(times)
    for distances in pairs:
        axes.plot(
            *thinned(seconds, distances), color="#9aa3b2", linewidth=0.8, alpha=max(0.12, 0.7 - 0.02 * len(pairs))
        )
    nearest = np.fmin.reduce(pairs)
    axes.plot(*thinned(seconds, nearest), color=OKABE_ITO[0], linewidth=2.0)
    at = int(np.nanargmin(nearest))
    _limit(axes, limit, f"safety distance {limit:g} m")
    axes.set_ylim(0.0, 1.08 * float(np.nanmax(pairs)))
    _lowest(axes, seconds[at], nearest[at])
    axes.set_ylabel("distance, m")
    canvas.mark_phases(axes, seconds[0], seconds[-1])
    title(axes, "Distances between drones")
    caption = "Every pair in grey, the smallest of all in blue. Below the red line would be too close."
    return Picture(canvas.save(figure, "distances.png"), "Distances between drones", caption)


def _obstacle_distances(canvas: Canvas) -> Picture | None:
    if not canvas.trace.swarm.obstacles:
        return None
    times = separation.common_times(canvas.flight)
    found = separation.obstacle_distances(canvas.trace, times)
    known = {number: d for number, d in found.items() if np.isfinite(d).any()}
    limit = canvas.trace.swarm.avoidance.obstacle_safety_distance
    if not known:
        return None
    figure, axes = canvas.panel()
    seconds = canvas.seconds(times)
    for number, distances in known.items():
        axes.plot(*thinned(seconds, distances), color=canvas.colour(number))
    nearest = np.fmin.reduce(list(known.values()))
    at = int(np.nanargmin(nearest))
    _limit(axes, limit, f"safety distance {limit:g} m")
    axes.set_ylim(min(0.0, 1.1 * nearest[at]), 1.08 * max(float(np.nanmax(d)) for d in known.values()))
    _lowest(axes, seconds[at], nearest[at])
    axes.set_ylabel("distance to the surface, m")
    canvas.mark_phases(axes, seconds[0], seconds[-1])
    canvas.legend(axes, known)
    title(axes, "Distances to obstacles")
    caption = "From each drone to the nearest obstacle's surface. Below the red line would be too close."
    return Picture(canvas.save(figure, "obstacle_distances.png"), "Distances to obstacles", caption)


def _latency(canvas: Canvas) -> Picture | None:
    hops = {hop: latencies(canvas.trace, hop) for hop in HOPS}
    known = {hop: delays[delays > 0.0] for hop, delays in hops.items() if (delays > 0.0).any()}
    if not known:
        return None
    figure, axes = canvas.panel(height=1.1 + 0.95 * len(known))
    shortest = min(float(delays.min()) for delays in known.values())
    longest = max(float(delays.max()) for delays in known.values())
    bins = np.geomspace(0.8 * shortest, 1.25 * longest, 140)
    for row, (delays, colour) in enumerate(zip(known.values(), OKABE_ITO, strict=False)):
        _ridge(axes, -row, delays, bins, colour)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlim(bins[0], bins[-1])
    axes.set_yticks([-row for row in range(len(known))], [hop.replace("_to_", " → ") for hop in known])
    axes.tick_params(axis="y", labelsize=10.5, labelcolor=INK)
    axes.set_ylim(0.75 - len(known), 0.9)
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("delay, ms")
    title(axes, "Latency of each hop")
    caption = "Distribution of the time from one message to its answer, all drones; ticks at the median and at 99 %."
    return Picture(canvas.save(figure, "latency.png"), "Latency", caption)


def _ridge(axes: Axes, base: float, delays: Floats, bins: Floats, colour: str) -> None:
    """Draw one hop's distribution standing on `base`, with its median and its 99th percentile."""
    counts, _ = np.histogram(delays, bins)
    heights = base + 0.62 * counts / counts.max()
    axes.fill_between(bins[:-1], base, heights, step="post", color=colour, alpha=0.75, linewidth=0)
    marks = percentiles(delays)
    for value, name, side in ((marks.p50, "p50", "right"), (marks.p99, "p99", "left")):
        if value is not None:
            axes.plot([value, value], [base - 0.06, base + 0.7], color=INK, linewidth=1.0)
            axes.annotate(
                f"{name} {value:.3g}", (value, base + 0.7), (-3 if side == "right" else 3, 0), va="top", ha=side,
                textcoords="offset points", fontsize=8.5, color=INK,
            )  # fmt: skip


def _limit(axes: Axes, value: float, text: str) -> None:
    axes.axhspan(-1e3, value, color=DANGER, alpha=0.06, linewidth=0, zorder=0)
    axes.axhline(value, color=DANGER, linewidth=1.1, zorder=1.5)
    _beside(axes, value, text, DANGER)


def _beside(axes: Axes, value: float, text: str, colour: str) -> None:
    """Name a horizontal line above its right end."""
    axes.annotate(
        text, (1.0, value), (-4, 3), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right",
        color=colour, fontsize=8.5, path_effects=[_HALO],
    )  # fmt: skip


def _lowest(axes: Axes, at: float, value: float) -> None:
    """Mark the smallest value of a series, whose axes have their limits."""
    axes.plot([at], [value], "o", markersize=5, markerfacecolor="white", markeredgecolor=INK, markeredgewidth=1.3)
    low = value < 0.12 * axes.get_ylim()[1]
    axes.annotate(
        f"{value:.2f} m", (at, value), (0, 8 if low else -8), textcoords="offset points", fontsize=9, ha="center",
        va="bottom" if low else "top", fontweight="bold", path_effects=[_HALO],
    )  # fmt: skip


_FIGURES: tuple[Callable[[Canvas], Picture | None], ...] = (
    _trajectories,
    _formation,
    _observation,
    _distances,
    _obstacle_distances,
    _latency,
)
