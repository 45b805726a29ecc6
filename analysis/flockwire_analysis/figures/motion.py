"""Positions and velocities, axis by axis, each curve with its reference; and the numbers that a law recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from flockwire_analysis.figures.drawing import INK, MOST_POINTS, Canvas, Picture, thinned
from flockwire_analysis.figures.legends import legend, line
from flockwire_analysis.series import Floats, Series
from flockwire_analysis.tracking import places, reference_velocities, references, velocities

DASHED = (0, (3, 2))
Curves = Mapping[int, tuple[Floats, Floats]]  # of each drone: times in s, values of shape n x 3


def positions(canvas: Canvas) -> Picture | None:
    """Draw x, y and z of every drone, and the places of the followers in the formation."""
    known = canvas.trace.placed()
    return _axes(
        canvas, "positions", "Positions", "m", "xyz",
        _at(canvas, known, places), _at(canvas, known, references), "place in the formation",
        "Position of each drone, axis by axis; dashed: its place in the formation.",
    )  # fmt: skip


def estimates(canvas: Canvas) -> Picture | None:
    """Draw every follower's estimate of the leader's position."""
    found = {i: canvas.trace.of("estimate", i) for i in canvas.trace.followers}
    leader = _at(canvas, tuple(i for i in canvas.trace.swarm.leaders if i in canvas.trace.placed()), places)
    return _axes(
        canvas, "estimates", "Estimates of the leader's position", "m", (r"$\eta_x$", r"$\eta_y$", r"$\eta_z$"),
        _series(canvas, found), leader, "the leader's position",
        "Each follower's estimate, axis by axis; dashed: the leader's position.",
    )  # fmt: skip


def speeds(canvas: Canvas) -> Picture | None:
    """Draw the velocity of every drone."""
    known = canvas.trace.placed()
    return _axes(
        canvas, "velocities", "Velocities", "m/s", (r"$v_x$", r"$v_y$", r"$v_z$"),
        _at(canvas, known, velocities), _at(canvas, known, reference_velocities), "velocity of the place",
        "Velocity of each drone, from its positions; dashed: the velocity of its place in the formation.",
    )  # fmt: skip


def commands(canvas: Canvas) -> Picture | None:
    """Draw the velocity that every pilot commanded."""
    found = {i: canvas.trace.of("command", i) for i in canvas.trace.flying}
    return _axes(
        canvas, "commands", "Commands", "m/s", (r"$u_x$", r"$u_y$", r"$u_z$"), _series(canvas, found),
        _at(canvas, canvas.trace.placed(), reference_velocities), "velocity of the place",
        "The velocity that each drone's pilot commanded; dashed: the velocity of its place in the formation.",
    )  # fmt: skip


def accelerations(canvas: Canvas) -> Picture | None:
    """Draw the acceleration that pilots commanded beside the velocity, if any did."""
    found = {i: canvas.trace.of("command", i) for i in canvas.trace.flying}
    curves = _series(canvas, {i: one for i, one in found.items() if one.values[:, 3:].any()}, 3)
    return _axes(
        canvas, "accelerations", "Commanded accelerations", "m/s²", (r"$a_x$", r"$a_y$", r"$a_z$"), curves, {}, "",
        "The acceleration that each drone's pilot commanded beside the velocity.",
    )  # fmt: skip


def _at(canvas: Canvas, numbers: tuple[int, ...], quantity: Callable[..., Floats]) -> Curves:
    times = canvas.flight.instants(MOST_POINTS)
    return {i: (canvas.seconds(times), quantity(canvas.trace, i, times)) for i in numbers}


def _series(canvas: Canvas, found: Mapping[int, Series], first: int = 0) -> Curves:
    curves = {}
    for number, series in found.items():
        shown = canvas.flight.holds(series.stamps)
        if shown.any():
            curves[number] = (canvas.seconds(series.stamps[shown]), series.values[shown, first : first + 3])
    return curves


def _axes(
    canvas: Canvas, name: str, title: str, unit: str, symbols: str | tuple[str, ...], curves: Curves, wanted: Curves,
    reference: str, caption: str,
) -> Picture | None:  # fmt: skip
    height = 4.3  # inches
    if not curves:
        return None
    figure, panels = canvas.panels(3, height)
    for axis, (axes, symbol) in enumerate(zip(panels, symbols, strict=True)):
        for number, (times, values) in curves.items():
            axes.plot(*thinned(times, values[:, axis]), color=canvas.colour(number), linewidth=0.9, alpha=0.9)
        for number, (times, values) in wanted.items():
            axes.plot(times, values[:, axis], color=canvas.colour(number), linewidth=0.8, linestyle=DASHED, zorder=4)
        axes.set_ylabel(f"{symbol}, {unit}")
        _roomy(axes, [values[:, axis] for _, values in curves.values()])
    figure.align_ylabels(panels)
    rows = canvas.over_time(panels)
    drawn = any(np.isfinite(values).any() for _, values in wanted.values())
    legend(panels[0], canvas.names(curves), [line(reference, INK, DASHED, 0.8)] if drawn else [], rows)
    return Picture(canvas.save(figure, name), title, caption)


def _roomy(axes: object, values: list[Floats]) -> None:
    """Widen the scale of an axis without motion, so that it does not show noise as motion."""
    known = np.concatenate([one[np.isfinite(one)] for one in values])
    if not len(known):
        return
    low, high = float(known.min()), float(known.max())
    middle, half = (low + high) / 2.0, max((high - low) * 0.54, 0.1)
    axes.set_ylim(middle - half, middle + half)  # type: ignore[attr-defined]


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
