"""What all figures share: colours that the colour-blind can distinguish, one look, thinning of long series."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from flockwire.control.graph import LEADER
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import uav
from matplotlib import colormaps, rc_context
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from flockwire_recorder.phases import Span, airborne, formation_phases
from flockwire_recorder.reading import Floats, Integers, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, MUTED, GRID, DANGER = "#1b1f27", "#69707d", "#e6e8ec", "#b3261e"
OKABE_ITO = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
MOST_POINTS = 4000  # of one line
ENVELOPE = 400

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans", "font.size": 10.5, "text.color": INK, "axes.labelcolor": INK,
    "axes.edgecolor": "#b9bec7", "axes.linewidth": 0.8, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "axes.axisbelow": True, "grid.color": GRID, "grid.linewidth": 0.8,
    "xtick.color": MUTED, "ytick.color": MUTED, "xtick.labelsize": 9.5, "ytick.labelsize": 9.5,
    "xtick.major.size": 0, "ytick.major.size": 0, "ytick.minor.size": 0,
    "legend.frameon": False, "legend.fontsize": 9.5, "lines.solid_capstyle": "round", "lines.linewidth": 1.4,
}  # fmt: skip


class Canvas:
    """What the figures of one trace have in common: colours, the origin of time, the spans to mark."""

    def __init__(self, trace: Trace, out: Path) -> None:
        self.trace, self.out = trace, out
        self.phases = formation_phases(trace)
        self.phase: Span | None = self.phases[0].span if self.phases else None
        self.flight = airborne(trace)
        self.origin = self.phase.begin if self.phase is not None else trace.begin
        self.time_label = "mission time, s" if self.phase is not None else "time since the trace's begin, s"

    def seconds(self, stamps: Integers) -> Floats:
        """Return `stamps` (Unix ns) as s of mission time."""
        return np.asarray((stamps - self.origin) / BILLION)

    def colour(self, number: int) -> str:
        """Return the colour of drone `number`, the same in every figure; the leader is black."""
        followers = self.trace.swarm.followers
        if number == LEADER:
            return INK
        place = followers.index(number)
        if len(followers) <= len(OKABE_ITO):
            return OKABE_ITO[place]
        return str(to_hex(colormaps["viridis"](0.95 * place / (len(followers) - 1))))

    def panel(self, width: float = 9.0, height: float = 3.9) -> tuple[Figure, Axes]:
        """Return a figure of `width` by `height` inches and its axes."""
        with rc_context(STYLE):
            figure = Figure(figsize=(width, height), layout="constrained")
            return figure, figure.add_subplot()

    def save(self, figure: Figure, name: str, dpi: int = 150) -> Path:
        """Write the figure as PNG; returns its path."""
        path = self.out / name
        with rc_context(STYLE):
            figure.savefig(path, dpi=dpi, facecolor="white")
        return path

    def legend(self, axes: Axes, numbers: Iterable[int]) -> None:
        """Name the drones above the axes."""
        drones = list(numbers)
        if len(drones) > 12:
            return
        lines = [axes.plot([], [], color=self.colour(i), linewidth=2.4, label=uav(i))[0] for i in drones]
        axes.legend(
            handles=lines, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(drones), handlelength=1.1,
            columnspacing=1.3, borderaxespad=0.2,
        )  # fmt: skip

    def mark_phases(self, axes: Axes, begin: float, end: float) -> None:
        """Draw what the operator ordered as lines at their times, and shade the tail of the formation phase."""
        for row, mission in enumerate(self.trace.missions):
            when = mission.start if mission.verb == "start" else mission.stamp
            at = (when - self.origin) / BILLION
            if begin <= at <= end:
                axes.axvline(at, color=MUTED, linewidth=0.9, linestyle=(0, (1, 2.5)), zorder=1.5)
                _name(axes, f"{mission.verb} {mission.formation}".strip(), at, "left", row % 2)
        for phase in self.phases:
            tail = phase.span.tail()
            left, right = ((edge - self.origin) / BILLION for edge in (tail.begin, tail.end))
            axes.axvspan(left, right, color="#0072b2", alpha=0.06, linewidth=0, zorder=0)
            _name(axes, "tail", right, "right")
        axes.set_xlim(begin, max(end, begin + 0.1))
        axes.set_xlabel(self.time_label)


def thinned(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a series of at most about MOST_POINTS that keeps the smallest and the largest value of each block."""
    block = -(-2 * len(times) // MOST_POINTS)
    if block < 3:
        return times, values
    whole = len(times) // block * block
    if not whole:
        return times, values
    blocks = values[:whole].reshape(-1, block)
    rows = np.sort(np.stack([np.argmin(blocks, axis=1), np.argmax(blocks, axis=1)], axis=1), axis=1)
    picked = (rows + np.arange(len(blocks))[:, None] * block).ravel()
    return times[picked], values[picked]


def envelope(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the largest value of each of some ENVELOPE blocks: what an error does not exceed."""
    block = max(1, len(times) // ENVELOPE)
    whole = len(times) // block * block
    return times[:whole:block], values[:whole].reshape(-1, block).max(axis=1)


def _name(axes: Axes, text: str, at: float, side: Literal["left", "right"], row: int = 0) -> None:
    """Write beside the vertical line at `at`, in the given row under the upper edge."""
    axes.annotate(
        text, (at, 1.0), (3 if side == "left" else -4, -3 - 12 * row), xycoords=("data", "axes fraction"),
        va="top", ha=side, textcoords="offset points", color=MUTED, fontsize=8.5,
    )  # fmt: skip


def title(axes: Axes, text: str) -> None:
    """Put a title above the axes, flush left."""
    axes.set_title(text, loc="left", fontsize=12, fontweight="bold", color=INK, pad=9)
