"""Legends above the axes, and their entries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from flockwire_analysis.figures.drawing import AXES_WIDTH, COLUMN, INK, MUTED, NAME_SIZE, OKABE_ITO, STYLE


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


def area(text: str) -> Artist:
    """Return an entry of a legend for the shaded tails."""
    return Patch(color=OKABE_ITO[0], alpha=0.12, linewidth=0, label=text)


_LEGEND: dict[str, Any] = {
    "handlelength": 1.2, "columnspacing": 1.0, "handletextpad": 0.5, "borderpad": 0.1, "labelspacing": 0.3,
}  # fmt: skip
MARK: dict[str, Any] = {
    "marker": "o", "markersize": 3.6, "markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 0.9,
    "zorder": 6,
}  # fmt: skip
