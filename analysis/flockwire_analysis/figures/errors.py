"""Observation and formation errors of the followers, and their convergence."""

from __future__ import annotations

import numpy as np
from flockwire_core.domain.time import SECOND
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from flockwire_analysis.figures.drawing import DANGER, MUTED, OKABE_ITO, Canvas, Picture, legend, line
from flockwire_analysis.phases import Span
from flockwire_analysis.series import Floats
from flockwire_analysis.tracking import SETTLED_BELOW, Errors, in_formation, settling_time

FLOOR = 1e-4  # m: the lower end of the axes: smaller errors are not drawn
DASHED = (0, (4, 3))
TAIL = "The flight is judged by the shaded tail of each phase."


def formation(canvas: Canvas) -> Picture | None:
    """Draw |x_i - h_i - x_0| while a formation was flown."""
    if not canvas.phases:
        return None
    errors = canvas.formation_errors
    flown = {
        i: Errors(error.stamps, np.where(in_formation(canvas.trace, error.stamps), error.values, np.nan))
        for i, error in errors.items()
    }
    return _over_time(
        canvas, flown, "formation_error", "Formation error", r"$|x_i - h_i - x_0|$, m",
        "How far each follower is from its place in the formation round the leader, while a formation is flown; the "
        f"largest of every tenth of a second or so. {TAIL}",
    )  # fmt: skip


def observation(canvas: Canvas) -> Picture | None:
    """Draw |eta_i - x_0|."""
    return _over_time(
        canvas, canvas.observation_errors, "observation_error", "Observation error", r"$|\eta_i - x_0|$, m",
        "How far each follower's estimate of the leader's position is from where the leader was; the largest of every "
        f"tenth of a second or so. {TAIL}",
    )  # fmt: skip


def convergence(canvas: Canvas) -> Picture | None:
    """Draw the observation errors from the first estimate until they are small."""
    errors = {i: error for i, error in canvas.observation_errors.items() if len(error.stamps)}
    if not errors:
        return None
    begin = min(int(error.stamps[0]) for error in errors.values())
    settled = settling_time(errors, Span(begin, max(int(error.stamps[-1]) for error in errors.values())))
    span = Span(begin, begin + int(SECOND * max(0.5, 2.0 * (settled if settled is not None else 5.0))))
    figure, (axes,) = canvas.panels()
    for number, error in errors.items():
        within = span.holds(error.stamps)
        axes.plot(canvas.seconds(error.stamps[within]), _drawn(error.values[within]), color=canvas.colour(number))
    _scale(axes, r"$|\eta_i - x_0|$, m")
    axes.set_xlim(canvas.second(span.begin), canvas.second(span.end))
    axes.set_xlabel(canvas.time_label)
    entries = [line(f"{SETTLED_BELOW:g} m", style=DASHED)]
    if settled is not None:
        since = canvas.second(begin) + settled
        axes.axvline(since, color=DANGER, linewidth=0.7, linestyle=(0, (1, 2)), zorder=1.5)
        entries.append(line(f"all below from {since:.2f} s on", DANGER, (0, (1, 2))))
    legend(axes, canvas.names(errors), entries)
    caption = "The same errors from the first estimate on, until they are small."
    return Picture(canvas.save(figure, "convergence"), "Convergence of the observer", caption)


def _over_time(
    canvas: Canvas, errors: dict[int, Errors], name: str, title: str, label: str, caption: str
) -> Picture | None:
    known = {}
    for number, error in errors.items():
        shown = canvas.flight.holds(error.stamps)
        if np.isfinite(error.values[shown]).any():
            known[number] = canvas.seconds(error.stamps[shown]), error.values[shown]
    if not known:
        return None
    figure, (axes,) = canvas.panels()
    for number, (times, values) in known.items():
        axes.plot(*_envelope(times, _drawn(values)), color=canvas.colour(number), alpha=0.9)
    _scale(axes, label)
    axes.set_ylim(top=max(4 * SETTLED_BELOW, *(2.0 * float(np.nanmax(values)) for _, values in known.values())))
    rows = canvas.over_time([axes], tails=True)
    tail = Patch(color=OKABE_ITO[0], alpha=0.12, linewidth=0, label="tail")
    legend(axes, canvas.names(known), [line(f"settled, {SETTLED_BELOW:g} m", style=DASHED), tail], rows)
    return Picture(canvas.save(figure, name), title, caption)


def _envelope(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the largest value of each of about 400 blocks, an upper bound of an error."""
    block = max(1, len(times) // 400)
    whole = len(times) // block * block
    return times[:whole:block], values[:whole].reshape(-1, block).max(axis=1)


def _drawn(values: Floats) -> Floats:
    """Return errors for a logarithmic axis, without zeros. Errors below FLOOR are not in view."""
    return np.where(values > 0.0, values, np.nan)


def _scale(axes: Axes, label: str) -> None:
    """Give the axes a logarithmic scale, and a line below which errors count as settled."""
    axes.set_yscale("log")
    axes.yaxis.set_minor_locator(NullLocator())  # invisible marks take longest to draw
    axes.set_ylim(bottom=FLOOR)
    axes.axhline(SETTLED_BELOW, color=MUTED, linewidth=0.7, linestyle=DASHED, zorder=1.5)
    axes.set_ylabel(label)
