"""Positions and velocities, axis by axis, each curve with its reference; and the numbers that a law recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from flockwire_analysis.figures.drawing import INK, MOST_POINTS, Canvas, Picture, legend, line, thinned
from flockwire_analysis.series import Floats
from flockwire_analysis.tracking import places, references, velocities

DASHED = (0, (3, 2))
Curves = Mapping[int, tuple[Floats, Floats]]  # of each drone: times in s, values of shape n x 3
_place_velocities = partial(velocities, references)


def positions(canvas: Canvas) -> Picture | None:
    """Draw x, y and z of every drone, and the places of the followers in the formation."""
    return _axes(
        canvas, "positions", "Positions", "{}, m", _at(canvas, places), _at(canvas, references),
        "place in the formation", "Position of each drone, axis by axis; dashed: its place in the formation.",
    )  # fmt: skip


def estimates(canvas: Canvas) -> Picture | None:
    """Draw every follower's estimate of the leader's position."""
    leaders = {i: curve for i, curve in _at(canvas, places).items() if i in canvas.trace.swarm.leaders}
    return _axes(
        canvas, "estimates", "Estimates of the leader's position", r"$\eta_{}$, m", _series(canvas, "estimate"),
        leaders, "the leader's position", "Each follower's estimate, axis by axis; dashed: the leader's position.",
    )  # fmt: skip


def speeds(canvas: Canvas) -> Picture | None:
    """Draw the velocity of every drone."""
    return _axes(
        canvas, "velocities", "Velocities", "$v_{}$, m/s", _at(canvas, partial(velocities, places)),
        _at(canvas, _place_velocities), "velocity of the place",
        "Velocity of each drone, from its positions; dashed: the velocity of its place in the formation.",
    )  # fmt: skip


def commands(canvas: Canvas) -> Picture | None:
    """Draw the velocity that every pilot commanded."""
    return _axes(
        canvas, "commands", "Commands", "$u_{}$, m/s", _series(canvas, "command"), _at(canvas, _place_velocities),
        "velocity of the place",
        "The velocity that each drone's pilot commanded; dashed: the velocity of its place in the formation.",
    )  # fmt: skip


def accelerations(canvas: Canvas) -> Picture | None:
    """Draw the acceleration that pilots commanded beside the velocity, if any did."""
    curves = {i: (times, values) for i, (times, values) in _series(canvas, "command", 3).items() if values.any()}
    return _axes(
        canvas, "accelerations", "Commanded accelerations", "$a_{}$, m/s²", curves, {}, "",
        "The acceleration that each drone's pilot commanded beside the velocity.",
    )  # fmt: skip


def _at(canvas: Canvas, quantity: Callable[..., Floats]) -> Curves:
    times = canvas.flight.instants(MOST_POINTS)
    return {i: (canvas.seconds(times), quantity(canvas.trace, i, times)) for i in canvas.trace.placed()}


def _series(canvas: Canvas, kind: str, first: int = 0) -> Curves:
    """Return three columns, from `first` on, of each drone's messages of a kind of key, where there are any."""
    found = {i: canvas.trace.of(kind, i) for i in canvas.trace.flying}
    shown = {i: canvas.flight.holds(series.stamps) for i, series in found.items()}
    return {
        i: (canvas.seconds(series.stamps[shown[i]]), series.values[shown[i], first : first + 3])
        for i, series in found.items()
        if shown[i].any()
    }


def _axes(
    canvas: Canvas, name: str, title: str, label: str, curves: Curves, wanted: Curves, reference: str, caption: str
) -> Picture | None:
    height = 4.3  # inches
    if not curves:
        return None
    figure, panels = canvas.panels(3, height)
    for axis, axes in enumerate(panels):
        for number, (times, values) in curves.items():
            axes.plot(*thinned(times, values[:, axis]), color=canvas.colour(number), linewidth=0.9, alpha=0.9)
        for number, (times, values) in wanted.items():
            axes.plot(times, values[:, axis], color=canvas.colour(number), linewidth=0.8, linestyle=DASHED, zorder=4)
        axes.set_ylabel(label.format("xyz"[axis]))
        _widen(axes, np.concatenate([values[:, axis] for _, values in curves.values()]))
    figure.align_ylabels(panels)
    rows = canvas.over_time(panels)
    drawn = any(np.isfinite(values).any() for _, values in wanted.values())
    legend(panels[0], canvas.names(curves), [line(reference, INK, DASHED, 0.8)] if drawn else [], rows)
    return Picture(canvas.save(figure, name), title, caption)


def _widen(axes: Axes, values: Floats) -> None:
    """Widen the scale of an axis without motion, so that it does not show noise as motion."""
    known = values[np.isfinite(values)]
    if len(known):
        low, high = float(known.min()), float(known.max())
        middle, half = (low + high) / 2.0, max((high - low) * 0.54, 0.1)
        axes.set_ylim(middle - half, middle + half)


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
