"""Common parts of figures: colours for the colour-blind, style, time axis, column width, legends.

A figure has the width of a paper's column, with legible type, as PNG and as PDF. Names are above the axes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from colorsys import hls_to_rgb
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from flockwire_core.domain.time import SECOND
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from flockwire_analysis.phases import Event, airborne, events, formation_phases, origin
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats, Integers
from flockwire_analysis.tracking import Errors, formation_errors, observation_errors

INK, MUTED, GRID, DANGER = "#1b1f27", "#69707d", "#e6e8ec", "#b3261e"
OKABE_ITO = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
COLUMN = 3.5  # inches: the width of one of two columns
MOST_POINTS = 1500  # of one line
MOST_NAMED = 12  # drones in a legend
NAME_SIZE = 6.5  # points, of the names of events
NAME_ROWS = 3  # of them
AXES_WIDTH = 0.82 * COLUMN * 72  # points, about

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans", "font.size": 7.5, "text.color": INK, "axes.labelcolor": INK,
    "axes.edgecolor": "#b9bec7", "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "axes.axisbelow": True, "grid.color": GRID, "grid.linewidth": 0.5, "axes.labelpad": 2.5,
    "xtick.color": MUTED, "ytick.color": MUTED, "xtick.labelsize": 7, "ytick.labelsize": 7,
    "xtick.major.size": 0, "ytick.major.size": 0, "ytick.minor.size": 0, "xtick.major.pad": 2, "ytick.major.pad": 2,
    "legend.frameon": False, "legend.fontsize": 7, "lines.solid_capstyle": "round", "lines.linewidth": 1.0,
    "axes.titlesize": 8.5, "figure.constrained_layout.h_pad": 0.02, "figure.constrained_layout.w_pad": 0.02,
    "pdf.fonttype": 42,
}  # fmt: skip
_LEGEND: dict[str, Any] = {
    "handlelength": 1.2, "columnspacing": 1.0, "handletextpad": 0.5, "borderpad": 0.1, "labelspacing": 0.3,
}  # fmt: skip


class Picture(NamedTuple):
    """A figure on disk and its caption."""

    path: Path
    title: str
    caption: str


class Canvas:
    """The common parts of a trace's figures, drawn in STYLE: colours, origin of time, window, events to mark."""

    def __init__(self, trace: Trace, out: Path, vector: bool = True) -> None:
        self.trace, self.out, self._vector = trace, out, vector
        self.phases = formation_phases(trace)
        self.flight = airborne(trace)
        self.origin = origin(trace)
        self.events = events(trace)
        self.time_label = f"t, s from the start of the {'formation' if self.phases else 'trace'}"

    @cached_property
    def formation_errors(self) -> dict[int, Errors]:
        """The result of `tracking.formation_errors`, for several figures."""
        return formation_errors(self.trace)

    @cached_property
    def observation_errors(self) -> dict[int, Errors]:
        """The result of `tracking.observation_errors`, for several figures."""
        return observation_errors(self.trace)

    def seconds(self, stamps: Integers) -> Floats:
        """Return `stamps` (Unix ns) as s of mission time."""
        return np.asarray((stamps - self.origin) / SECOND)

    def second(self, stamp: int) -> float:
        """Return `stamp` (Unix ns) as s of mission time."""
        return (stamp - self.origin) / SECOND

    def colour(self, number: int) -> str:
        """Return the colour of drone `number`, the same in every figure and page (view/pen.js); the leader is black."""
        followers = self.trace.swarm.followers
        if number in self.trace.swarm.leaders:
            return INK
        place = followers.index(number)
        if len(followers) <= len(OKABE_ITO):
            return OKABE_ITO[place]
        return str(to_hex(hls_to_rgb(place / len(followers), 0.36 + 0.14 * (place % 2), 0.65)))

    def name(self, number: int) -> str:
        """Return how pages and figures name drone `number`."""
        return self.trace.plan.pilot[number]

    def panels(self, rows: int = 1, height: float = 2.3) -> tuple[Figure, list[Axes]]:
        """Return a figure of `rows` axes above each other with one time axis, `height` inches in all."""
        figure = Figure(figsize=(COLUMN, height), layout="constrained")
        return figure, list(np.atleast_1d(figure.subplots(rows, 1, sharex=True)))

    def save(self, figure: Figure, name: str) -> Path:
        """Write the figure as NAME.png and NAME.pdf; returns the path of the first."""
        dpi = 320
        path = self.out / f"{name}.png"
        figure.savefig(path, dpi=dpi, facecolor="white")
        if self._vector:
            figure.savefig(path.with_suffix(".pdf"), metadata={"CreationDate": None})
        return path

    def names(self, numbers: Iterable[int]) -> list[Artist]:
        """Return the drones as entries of a legend, none if they are too many."""
        drones = list(numbers)
        named = drones if len(drones) <= MOST_NAMED else []
        return [line(self.name(i), self.colour(i), width=1.8) for i in named]

    def over_time(self, axes: Sequence[Axes], tails: bool = False) -> int:
        """Give the axes the flight's time axis, with a line for each event and its name above; shade the `tails`.

        Returns the number of rows of names.
        """
        shown = self.flight
        begin, end = self.second(shown.begin), self.second(shown.end)
        marked = [event for event in self.events if shown.begin <= event.stamp <= shown.end]
        for one in axes:
            for event in marked:
                one.axvline(self.second(event.stamp), color=MUTED, linewidth=0.6, linestyle=(0, (1, 2.5)), zorder=1.5)
            if tails:
                self._shade_tails(one)
            one.set_xlim(begin, max(end, begin + 0.1))
        axes[-1].set_xlabel(self.time_label)
        places = [(self.second(event.stamp) - begin) / max(end - begin, 0.1) for event in marked]
        return _name_all(axes[0], marked, places)

    def _shade_tails(self, axes: Axes) -> None:
        for phase in self.phases:
            tail = phase.span.tail()
            left, right = self.second(tail.begin), self.second(tail.end)
            axes.axvspan(left, right, color=OKABE_ITO[0], alpha=0.07, linewidth=0, zorder=0)


def _name_all(axes: Axes, marked: Sequence[Event], places: Sequence[float]) -> int:
    """Write the names of events above the axes; return the number of rows."""
    rows = rows_of(marked, places)
    for event, place, row, before in zip(marked, places, rows, _before(marked, places), strict=True):
        if row is None:
            continue
        edge = place > 1.0 - _width(event.text) and not before
        shift = 0 if edge else -1 if before else 1
        axes.annotate(
            event.text, (1.0 if edge else place, 1.0), (shift, 1.5 + (NAME_SIZE + 1.5) * row),
            xycoords="axes fraction", textcoords="offset points", va="bottom",
            ha="right" if edge or before else "left", color=MUTED, fontsize=NAME_SIZE,
        )  # fmt: skip
    return len({*rows} - {None})


def rows_of(marked: Sequence[Event], places: Sequence[float]) -> list[int | None]:
    """Return the row of each event's name without overlaps, None if there is no room.

    `places` are shares of the axes' width, ascending.
    """
    ends = [-1.0] * NAME_ROWS
    rows: list[int | None] = []
    for event, place in zip(marked, places, strict=True):
        width = _width(event.text)
        left = min(place, 1.0 - width)
        free = [row for row, end in enumerate(ends) if end <= left]
        if free:
            ends[free[0]] = left + width
        rows.append(free[0] if free else None)
    return rows


def _width(text: str) -> float:
    """Return the width of an event's name, as a share of the axes' width."""
    letter = 0.56 * NAME_SIZE  # points that a letter takes
    return (len(text) + 1.5) * letter / AXES_WIDTH


def _before(marked: Sequence[Event], places: Sequence[float]) -> list[bool]:
    """Return the names to put before their lines, because behind them they would overlap the next event's."""
    beyond = 0.18  # share of the axes' width on their left that a name may use
    found, taken = [], -beyond
    for event, place, following in zip(marked, places, (*places, 2.0)[1:], strict=True):
        width = _width(event.text)
        found.append(following - place < width and place - width >= taken)
        taken = max(taken, place + width)
    return found


def legend(axes: Axes, drones: Sequence[Artist], others: Sequence[Artist] = (), rows: int = 0) -> None:
    """Name the drones above the axes and their `rows` of events, and other curves above them."""
    figure_width = 0.97 * COLUMN * 72  # points
    figure = axes.figure.get_figure(root=True)
    if others:
        figure.legend(
            handles=list(others), loc="outside upper left", ncols=_columns(others, figure_width), borderaxespad=0.4,
            **_LEGEND,
        )  # fmt: skip
    if drones:
        room = ScaledTranslation(0.0, (1.5 + (NAME_SIZE + 1.5) * rows) / 72, figure.dpi_scale_trans)
        axes.legend(
            handles=list(drones), loc="lower left", bbox_to_anchor=(0.0, 1.0), bbox_transform=axes.transAxes + room,
            ncols=_columns(drones, AXES_WIDTH), borderaxespad=0.0, **_LEGEND,
        )  # fmt: skip


def _columns(entries: Sequence[Artist], width: float) -> int:
    """Return the most columns of a legend that fit into `width` points, in rows of equal length."""
    size = STYLE["legend.fontsize"]
    mark = size * sum(_LEGEND[part] for part in ("handlelength", "columnspacing", "handletextpad"))
    labels = [mark + 0.56 * size * len(str(entry.get_label())) for entry in entries]
    for rows in range(1, len(labels)):
        columns = [max(labels[k : k + rows]) for k in range(0, len(labels), rows)]  # filled one after the other
        if sum(columns) <= width:
            return len(columns)
    return 1


def line(text: str, colour: str = MUTED, style: Any = "-", width: float = 1.0) -> Artist:  # noqa: ANN401
    """Return an entry of a legend for a line."""
    return Line2D([], [], color=colour, linestyle=style, linewidth=width, label=text)


def thinned(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a series of at most about MOST_POINTS that keeps the smallest and the largest value of each block."""
    block = -(-2 * len(times) // MOST_POINTS)
    if block < 3:
        return times, values
    whole = len(times) // block * block
    blocks = values[:whole].reshape(-1, block)
    rows = np.sort(np.stack([np.argmin(blocks, axis=1), np.argmax(blocks, axis=1)], axis=1), axis=1)
    picked = (rows + np.arange(len(blocks))[:, None] * block).ravel()
    return times[picked], values[picked]
